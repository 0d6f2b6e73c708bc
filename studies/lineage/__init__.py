"""Catalogue lines, works and measured runs on which the numbers of a clip rest: ``musync lab lineage``."""
