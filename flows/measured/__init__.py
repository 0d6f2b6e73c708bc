"""Measured runs: in, calibrated on, and what the model lacks."""
