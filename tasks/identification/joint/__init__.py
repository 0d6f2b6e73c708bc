"""All numbers of a car at once: robust joint fits from several starts, for cars that the vehicle file hardly knows."""
