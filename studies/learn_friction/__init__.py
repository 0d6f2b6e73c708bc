"""A network learns from the pictures before a brake how hard the car will brake, with the physics and without."""
