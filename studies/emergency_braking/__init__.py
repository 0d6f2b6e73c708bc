"""Emergency brakes against protocols in every weather."""
