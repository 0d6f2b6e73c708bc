"""Known truth: how far a calibration comes back to the scalars that made its traces, and how well it knows it."""
