"""Rigid bodies of road users as Gaussians: cars, vans, trucks, pedestrians, bicycles."""
