"""Catalogue lines, works and measured runs on which the numbers of a clip rest: ``python -m studies lineage``."""
