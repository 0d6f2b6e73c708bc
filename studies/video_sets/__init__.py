"""Edited videos of many models judged by one protocol: ``python -m studies judge-set``."""
