"""What cannot be told from what was named, and how large an effect would have to be to be named at all."""

from dataclasses import replace

import numpy as np

from tasks.closure.answer import NamedEffect, named_effect
from tasks.closure.attribution import (  # fmt: skip
    ACCEPT_SCORE,
    RIVAL_SPAN,
    WIN_SHARE,
    judge,
    ladder,
    nested,
    win_share,
    without,
)
from tasks.closure.campaign import SESSION
from tasks.closure.fit import Fit, misfit_by_run
from tasks.closure.screening import Evidence, inflation
from tasks.closure.search import Round


def rivals(
    evidence: Evidence, base: Fit, rounds: list[Round]
) -> tuple[list[NamedEffect], list[tuple[str, NamedEffect]]]:
    named, near = [], []
    for i, found in enumerate(rounds):
        rest, own, tried = found.base, found.accepted, found.tried
        if i + 1 < len(rounds):
            # what was accepted later may change how this effect compares with its rivals
            rest = without(base, i, evidence)
            at = sum(len(p.names) for p in base.parts[:i])
            part = replace(base.parts[i], start=base.values[at : at + len(base.parts[i].names)])
            own = judge(evidence, rest, misfit_by_run(evidence.held_out, rest), part)
            tried = tuple(ladder(evidence, rest)) if own.hypothesis.effect_class != "form" else ()
        others = [c for c in tried if c.hypothesis.name != own.hypothesis.name]
        share = win_share([own, *others], rest)
        named.append(named_effect(own, share))
        for c in others:
            wins = win_share([c, own, *[o for o in others if o is not c]], rest)
            close = c.score > own.score - RIVAL_SPAN or (share < WIN_SHARE and wins > 0.5 * (1.0 - WIN_SHARE))
            if close and not nested(own.hypothesis, c.hypothesis) and c.score > 0.0:
                near.append((own.hypothesis.name, named_effect(c, wins)))
    return named, near


def detectable(evidence: Evidence, base: Fit) -> dict[str, float]:
    """Smallest first parameter whose linear gain would pass the score gate, at the level of the null's inflation."""
    level = inflation(evidence, base, None)
    needed = 2.0 * level * (ACCEPT_SCORE + np.log(evidence.samples))
    library = np.zeros((len(evidence.effects),) * 2)
    cross = np.zeros((len(evidence.effects), len(SESSION)))
    session = np.diag(1.0 / np.square(evidence.session_sigma))
    for run in evidence.train:
        q = run.library_q
        library += run.library.T @ run.library - q.T @ q
        cross += run.library.T @ run.session - q.T @ run.session_q
        session += run.session.T @ run.session - run.session_q.T @ run.session_q
    information = np.diag(library) - np.einsum("ij,jk,ik->i", cross, np.linalg.inv(session), cross)
    return {
        e.name: float(np.sqrt(needed / i)) if i > 0 else float("inf")
        for e, i in zip(evidence.effects, information, strict=True)
    }
