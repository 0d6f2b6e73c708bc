"""Clips on a GPU: agreement with the processor, and time."""
