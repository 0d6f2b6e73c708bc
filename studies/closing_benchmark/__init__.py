"""How often ``close-loop`` is right on campaigns whose truth is known: ``python -m studies closing-benchmark``."""
