"""What a user says of the effects in the model counts in the diagnosis as it does in the fit; and
what an effect of no size led to is kept without it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
import pytest

from flexgui.core.diagnose.base_fit import BaseFit
from flexgui.core.diagnose.fit_problem import parametrised, with_values
from flexgui.core.diagnose.refit import fit, with_robust_covariance
from flexgui.core.diagnose.removal_and_exchange import needed_effects
from flexgui.core.effects import effect
from tests.diagnose import fits
from tests.diagnose.fits import on_paper

TRUE = 6.0
"""N m s/rad, viscous friction of joint 1; joint 2 has half of it."""

SAME = 0.01
"""Relative, of a coefficient that is estimated from one short recording."""


def begun(also: Mapping[str, Mapping[str, float]] | None = None, **friction: Any) -> BaseFit:
    """The paper's arm with friction, in a model that states it as given; `also`: what else its
    recording holds."""
    effects = [{"id": "viscous_friction", **friction}] if friction else []
    hidden = {"viscous_friction": {"fv1": TRUE, "fv2": TRUE / 2}, **(also or {})}
    return fits.begun(on_paper(
        model={"level": "nonlinear", "effects": effects},
        sensors={"camera_noise": 3e-5, "encoder_noise": 1e-5},
        identify={"parameters": ["EI"], "output": ["z", "encoder"]},
        recordings=[{"simulate": {"theta2": 1.2, "seconds": 0.4}, "hidden": hidden}],
    ))  # fmt: skip


@cache
def bare() -> BaseFit:
    return begun()


def test_a_parameter_that_is_not_to_vary_stays_where_it_was_stated() -> None:
    found = begun(fv1={"start": 5.0, "vary": False}, fv2=3.0)
    h = found.base.parametrised
    assert "fv1" not in h.unknowns.labels and "fv2" in h.unknowns.labels
    assert h.model.effect_values["fv1"] == 5.0
    more = [*h.model.effects, effect("tip_payload")]
    later = parametrised(found.data, more, h.values())
    assert later.model.effect_values["fv1"] == 5.0 and "fv1" not in later.unknowns.labels


def test_a_users_bounds_hold_in_the_diagnosis() -> None:
    at = begun(fv1={"start": 5.0, "upper": 5.5}, fv2=3.0).base.parametrised
    assert at.values()["fv1"] == pytest.approx(5.5)


def test_without_a_word_a_stated_effect_is_estimated() -> None:
    at = begun(fv1=5.0, fv2=2.0).base.parametrised
    assert at.values()["fv1"] == pytest.approx(TRUE, rel=SAME)


def test_the_last_effect_goes_too_where_the_others_do_as_well_without_it() -> None:
    """It has no size, and the friction before it now stands where it belongs."""
    data = bare().data
    viscous, payload = effect("viscous_friction"), effect("tip_payload")
    values = {**bare().base.parametrised.values(), "fv1": TRUE, "fv2": TRUE / 2, "mt2": 1e-6}
    whole = with_robust_covariance(
        fit(parametrised(data, [viscous, payload], values), None, lambda: False, 6)
    )
    kept = needed_effects(data, whole, [viscous, payload], 0, lambda: False)
    assert [e.kind for e in kept.effects] == ["viscous_friction"]
    assert np.isfinite(kept.refit.cost)


def test_an_effect_that_is_needed_stays_though_it_is_the_last() -> None:
    data = bare().data
    viscous = effect("viscous_friction")
    start = {**bare().base.parametrised.values(), "fv1": TRUE, "fv2": TRUE / 2}
    whole = with_robust_covariance(
        fit(parametrised(data, [viscous], start), None, lambda: False, 6)
    )
    kept = needed_effects(data, whole, [viscous], 0, lambda: False)
    assert [e.kind for e in kept.effects] == ["viscous_friction"]


def test_unknowns_have_one_order_where_an_effect_is_stated_beside_first_places() -> None:
    """Else a vector was read with the labels of another, and every refit beside a stated effect
    ended far off."""
    found = begun(fv1=5.0, fv2=3.0)
    more = parametrised(found.data, [*found.base.parametrised.model.effects, effect("tip_payload")],
                      found.base.parametrised.values())  # fmt: skip
    assert "start_theta1@" in " ".join(more.unknowns.labels)
    again = with_values(found.data, more, refine=1)
    assert again.unknowns.labels == more.unknowns.labels
