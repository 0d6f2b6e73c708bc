"""What a dataset of a million clips takes on five hundred workers: measured constants, and the table that follows."""
