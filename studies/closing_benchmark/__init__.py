"""How often ``close-loop`` is right on campaigns whose truth is known: ``musync lab close-loop-benchmark``."""
