"""A Gaussian street from a posed stereo sequence, on CPU and without training."""
