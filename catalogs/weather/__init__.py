"""Kinds of weather: how they grip and how they look, from one file for each."""
