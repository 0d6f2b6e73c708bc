"""From a grid to a sealed dataset."""
