"""The cost of a million clips on five hundred workers: measured constants, and the table that follows."""
