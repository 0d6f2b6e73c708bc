"""Audits: whether a dataset still holds the recorded bytes, and how each of its numbers follows from its inputs."""
