"""Surface state to the friction coefficient that the tyre model is scaled to."""

from math import exp

from tasks.surface.state import SurfaceParameters, SurfaceState, Weather


def surface_friction(weather: Weather, state: SurfaceState, parameters: SurfaceParameters) -> float:
    """Reference friction coefficient mu_c [1] (paper, Eq. surface_friction_mapping).

    Continuous in the rate within rain (from dry_friction) and within snow (from bare_wet_friction); between
    dry and the lightest snow it jumps from dry_friction to bare_wet_friction, as in the paper.

    Parameters
    ----------
    weather : its kind chooses the branch
    state : film depth or snow coverage
    parameters : the friction anchors
    """
    p = parameters
    if weather.kind == "dry":
        return p.dry_friction
    if weather.kind == "rain":
        r_f = p.flooded_friction / p.dry_friction
        return p.dry_friction * (r_f + (1 - r_f) * exp(-state.film_depth_mm / p.film_decay_mm))
    return p.bare_wet_friction - (p.bare_wet_friction - p.snow_friction) * state.snow_coverage
