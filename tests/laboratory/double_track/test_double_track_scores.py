"""Outcomes, F1, bias and coverage of judged double-track campaigns."""

import pytest

from studies.double_track.outcomes import estimate_of, judge_verdict
from studies.double_track.scores import find_f1, summarise

NULL = {
    "group": "null",
    "effect": None,
    "library": None,
    "form": None,
    "values": {},
    "size": 0,
    "same_form": False,
}
DRAG = {
    **NULL,
    "group": "standard",
    "effect": "drag",
    "library": "aerodynamic_drag",
    "values": {"drag_area": 0.5},
}
FORM = {**NULL, "group": "forms", "effect": "hump", "form": {"port": "friction", "variable": "speed"}}


def effect(name, kind="effect", port="longitudinal_force", variable="speed"):
    number = {"value": 0.6, "ci_low": 0.4, "ci_high": 0.7}
    return {
        "name": name,
        "class": kind,
        "port": port,
        "variable": variable,
        "parameters": {"drag_area": number},
    }


def verdict(name, *effects, rivals=()):
    return {"verdict": name, "effects": list(effects), "rivals": list(rivals)}


RIGHT = effect("aerodynamic_drag")
GRIP = effect("form", "form", "friction", "speed")


@pytest.mark.parametrize(
    ("label", "said", "outcome"),
    [
        (NULL, verdict("NOTHING"), "exact"),
        (NULL, verdict("FOUND", RIGHT), "wrong"),
        (DRAG, verdict("NOTHING"), "nothing"),
        (DRAG, verdict("FOUND", RIGHT), "exact"),
        (DRAG, verdict("FOUND", RIGHT, effect("brake_lag")), "wrong"),
        (DRAG, verdict("FOUND", effect("headwind")), "wrong"),
        (DRAG, verdict("SET", effect("headwind"), rivals=[RIGHT]), "set with the truth"),
        (DRAG, verdict("SET", effect("headwind"), rivals=[effect("pad_drag")]), "wrong"),
        (DRAG, verdict("UNKNOWN_FORM", GRIP), "form instead"),
        (DRAG, verdict("UNKNOWN_FORM", GRIP, RIGHT), "wrong"),
        (FORM, verdict("UNKNOWN_FORM", GRIP), "exact"),
        (FORM, verdict("UNKNOWN_FORM", GRIP, RIGHT), "wrong"),
        (FORM, verdict("UNKNOWN_FORM", effect("form", "form"), rivals=[GRIP]), "set with the truth"),
        (FORM, verdict("FOUND", RIGHT), "wrong"),
        (FORM, verdict("NOTHING"), "nothing"),
    ],
)
def test_outcomes(label, said, outcome):
    assert judge_verdict(label, said) == outcome


def test_an_estimate_counts_only_where_the_truth_alone_is_named():
    assert estimate_of(DRAG, verdict("FOUND", RIGHT)) == {"truth": 0.5, "value": 0.6, "low": 0.4, "high": 0.7}
    assert estimate_of(DRAG, verdict("FOUND", RIGHT, effect("brake_lag"))) is None
    assert estimate_of(NULL, verdict("NOTHING")) is None


def row(label, said, **more):
    named = [[e["name"], e["port"], e["variable"]] for e in said["effects"]]
    return {
        **label, "campaign": "c", "verdict": said["verdict"], "outcome": judge_verdict(label, said), "named": named,
        "rivals": [], "reasons": ["none"], "estimate": estimate_of(label, said), **more,
    }  # fmt: skip


def test_f1_counts_claims_and_truths():
    rows = [
        row(NULL, verdict("NOTHING")), row(NULL, verdict("FOUND", RIGHT)), row(DRAG, verdict("FOUND", RIGHT)),
        row(DRAG, verdict("NOTHING")), row(FORM, verdict("UNKNOWN_FORM", GRIP)),
    ]  # fmt: skip
    assert find_f1(rows) == {
        "precision": pytest.approx(2 / 3),
        "recall": pytest.approx(2 / 3),
        "f1": pytest.approx(2 / 3),
    }


def test_bias_and_coverage_are_of_first_parameters_whose_form_is_the_librarys():
    honest, other = {**DRAG, "same_form": True}, {**DRAG, "values": {"drag_area": 1.0}}
    figures = summarise([row(honest, verdict("FOUND", RIGHT)), row(other, verdict("FOUND", RIGHT))])
    assert figures["bias"] == {
        "mean_relative": pytest.approx(-0.1),
        "mean_absolute_relative": pytest.approx(0.3),
        "of": 2,
    }
    assert (figures["coverage"]["hits"], figures["coverage"]["of"]) == (1, 1)
    assert (figures["coverage_with_other_forms"]["hits"], figures["coverage_with_other_forms"]["of"]) == (
        1,
        2,
    )
