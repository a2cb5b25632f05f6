"""An effect whose size is no larger than its own deviation is not named."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from flexgui.core.diagnose.acceptance import near_neutral_objection
from flexgui.core.diagnose.cost_minimum import converge
from flexgui.core.diagnose.fit_problem import parametrised
from flexgui.core.diagnose.refit import Refit, robust_covariance
from flexgui.core.effects import effect
from flexgui.core.results import Objection, Reason
from tests.diagnose.test_stated_effects import bare


@cache
def fitted(*kinds: str) -> Refit:
    """The arm with viscous friction, modelled with these effects."""
    data = bare().data
    start = parametrised(data, [effect(k) for k in kinds], bare().base.parametrised.values())
    return converge(data, start, None, lambda: False)[1]


def objection(kind: str, *others: str) -> Objection | None:
    after = fitted(kind, *others)
    labels = after.parametrised.unknowns.labels
    own = effect(kind).parameters(bare().data.rig.arm, bare().data.rig.drive, bare().data.sizes)
    names = tuple(k.parameter.name for k in own if k.parameter.name in labels and not k.secondary)
    return near_neutral_objection([SimpleNamespace(effect=effect(kind), parameters=names)], after)


def test_a_friction_that_is_there_is_distinct() -> None:
    assert objection("viscous_friction") is None
    assert objection("viscous_friction", "torque_offset") is None


@pytest.mark.parametrize("kind", ["torque_offset", "air_drag"])
def test_what_is_not_there_is_not_distinct_from_zero(kind: str) -> None:
    # As text: a bound that is no number is not equal to itself.
    assert repr(objection(kind, "viscous_friction")) == repr(Objection(Reason.INDISTINCT))


def test_a_size_at_its_bound_has_no_deviation_and_is_left_to_other_rules() -> None:
    there = fitted("viscous_friction")
    h = there.parametrised
    after = replace(there, parametrised=h.at(np.minimum(h.vector, h.limits.lower)))
    assert not np.isfinite(np.diag(robust_covariance(after))).any()
    friction = SimpleNamespace(effect=effect("viscous_friction"), parameters=("fv1", "fv2"))
    assert near_neutral_objection([friction], after) is None
