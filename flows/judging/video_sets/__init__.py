"""Verdicts on pictures and telemetry."""
