"""Workers that make clips, and progress and failures that are reported."""
