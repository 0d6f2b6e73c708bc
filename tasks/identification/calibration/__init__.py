"""Calibration of known parameters: staged fits of a vehicle's scalars to reference traces, and their uncertainty."""
