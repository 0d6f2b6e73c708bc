"""The library of effects holds what the search for a missing one needs."""

from catalogs.entries import load


def test_the_library_has_at_least_24_effects() -> None:
    effects = load("library of effects")
    assert sum(e.effect_class == "effect" for e in effects) >= 24
    assert {e.effect_class for e in effects} == {"effect", "retune", "sensor"}


def test_what_matters_is_within_the_bounds_and_larger_than_a_derivatives_step_is_small() -> None:
    """One mistyped power of ten would name nothing, or everything."""
    for effect in load("library of effects"):
        number = effect.parameters[0]
        assert effect.matters < 0.5 * max(number.upper, -number.lower), effect.name
