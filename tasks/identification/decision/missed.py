"""Stops that no fit has seen and that the model misses by more than their noise, whatever is named."""

from dataclasses import replace

from tasks.identification.decision.answer import Verdict


def report_miss(verdict: Verdict, limit: float) -> Verdict:
    """Return a verdict that says by how much the speed of held-out runs is missed, where that is more than noise.

    Parameters
    ----------
    verdict : the answer
    limit : error over noise from which a run is missed [1]
    """
    error, (_, noise) = verdict.error["speed"].after, verdict.noise["speed"]
    # a disagreement says that nothing could be named, and not that what is named is not all
    if error <= limit * noise or (verdict.disagreement and not verdict.effects):
        return verdict
    missed = (
        f"the speed of the held-out runs is missed by {error:.3g} m/s, {error / noise:.3g} times its noise (at most"
        f" {limit:g})"
    )
    if not verdict.effects:
        return replace(verdict, misses=True, disagreement=missed, reasons=(missed, *verdict.reasons))
    return replace(
        verdict,
        misses=True,
        reasons=(*verdict.reasons, f"{missed}: what is named is not all that the model lacks"),
    )
