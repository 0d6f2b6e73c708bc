"""The built-in street: a Gaussian scene made from a seed."""
