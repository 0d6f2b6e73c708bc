"""A small network tells dry, wet and snow on real photographs: with our frames, with real ones, and with both."""
