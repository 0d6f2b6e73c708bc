"""The paper's exact visual anchors: rates between which pictures are blended (Appendix A.4)."""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import replace

from tasks.surface.state import SurfaceParameters, SurfaceState
from tasks.surface.weather import Weather, surface_state


def adjacent_anchors(
    weather: Weather, rates_mm_h: Sequence[float], parameters: SurfaceParameters
) -> tuple[SurfaceState, ...]:
    """Surface states of the two anchors that a rate lies between.

    Parameters
    ----------
    weather : kind and rate
    rates_mm_h : rates of the anchors, ascending [mm/h]
    parameters : the pavement

    Returns
    -------
    Two states, the lower rate first; none at an anchor, where the picture is exact, and outside the range of the
    anchors, of which the paper says nothing.
    """
    rate = weather.precipitation_mm_h
    above = bisect_left(rates_mm_h, rate)
    if above in (0, len(rates_mm_h)) or rates_mm_h[above] == rate:
        return ()
    pair = rates_mm_h[above - 1 : above + 1]
    return tuple(surface_state(replace(weather, precipitation_mm_h=anchor), parameters) for anchor in pair)
