"""The library of effects holds what the search for a missing one needs."""

from catalogs.effects import load_effects


def test_the_library_has_at_least_24_effects() -> None:
    effects = load_effects()
    assert sum(e.effect_class == "effect" for e in effects) >= 24
    assert {e.effect_class for e in effects} == {"effect", "retune", "sensor"}
