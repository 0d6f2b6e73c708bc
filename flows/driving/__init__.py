"""A car that is driven step by step: by hand, by a policy, and against the protocols of emergency brakes."""
