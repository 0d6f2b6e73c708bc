"""Videos and trajectories that others made: how they are read, and what of a claim their motion bears out."""
