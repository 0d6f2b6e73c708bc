"""What is told stays told only where the last fit, which reports it, agrees."""

from types import SimpleNamespace

import numpy as np
import pytest

from catalogs.decision_rules import load_decision_rules
from tasks.identification.decision import naming
from tasks.identification.decision.odds import search_explanations
from tasks.identification.decision.told import list_open_explanations
from tests.identification.explained import form_of, grams_of


@pytest.mark.parametrize(("value", "told"), [(-1.5, 0), (-2.5, 1)])
def test_no_form_is_named_whose_interval_holds_no_form_at_all(monkeypatch, value, told):
    """The spline's values have errors of 1: a coefficient of -1.5 may be 0, one of -2.5 is not."""
    form, rules = form_of("friction", "load_ratio", (0, 1)), load_decision_rules()
    designs = [np.eye(2) / 2.0] * 4
    grams = grams_of([form], designs, [x @ np.array([9.0, -9.0]) for x in designs])
    opened = list_open_explanations(grams, search_explanations(grams, most=1, width=8), rules)
    assert [one.name for one in opened[0].told] == [form.name]
    shape = SimpleNamespace(
        name="friction ~ a",
        port="friction",
        effect_class="form",
        names=("a",),
        lower=(-9.0,),
        upper=(9.0,),
        units=("1",),
    )  # fmt: skip
    fitted = SimpleNamespace(parts=(shape,), values=np.array([value]), covariance=np.array([[0.01]]))
    monkeypatch.setattr(naming, "fit_told", lambda finding, opened: fitted)
    monkeypatch.setattr(naming, "refine_fit", lambda finding, fitted: fitted)
    settled, _ = naming.settle_told(None, opened, rules)
    assert len(settled[0].told) == told
