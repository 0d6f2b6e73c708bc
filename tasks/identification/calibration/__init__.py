"""Calibration of what is known: staged fits of a vehicle's scalars to reference traces, and how well they are known."""
