"""The reference vehicle and its scenarios, as the tests of the vehicle have them."""

from tests.vehicle.conftest import drive, vehicle

__all__ = ["drive", "vehicle"]
