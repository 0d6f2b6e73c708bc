"""Edited videos of many models judged by one protocol: ``musync lab judge-set``."""
