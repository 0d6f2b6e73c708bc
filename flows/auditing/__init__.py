"""Whether a dataset still is what was made, and why a number in it is what it is."""
