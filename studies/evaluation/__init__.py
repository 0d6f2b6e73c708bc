"""A dataset judged from its pixels, beside the figures that the paper prints: poses, motion, road edits, weather."""
