"""Mutated inputs for every parser: each is refused in a sentence or accepted, and nothing else happens.

``python -m studies.fuzzing`` reads 100,000 inputs; ``--parser P --input N`` makes and reads one of them alone.
"""
