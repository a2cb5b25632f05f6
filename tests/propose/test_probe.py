"""A force that is given over time answers as the law that it was computed from."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.effects.own import own_effect
from flexgui.core.effects.own_formula import own_parameter
from flexgui.core.estimate.fitted_model import FittedModel
from flexgui.core.estimate.problem import problem_of
from flexgui.core.propose.probe import Probe, at_joint, at_tip, responses
from tests.propose.test_targets import fitted

SMALL = 1e-3
"""N m or N: a response is a slope."""

HELD = 0.03
"""Relative: a signal is held for a sample, a law is not."""


def answer(model: FittedModel, target: str, formula: str) -> list[np.ndarray]:
    """What the formula at the size SMALL changes the errors (M, k) by, per unit of its size."""
    h, data = model.refit.problem, model.data
    own = own_effect(h.model.arm, target, formula, (own_parameter("a", SMALL),), "own_1")
    with_law = problem_of(data, [own], {**h.values(), "a": SMALL}, freed=())
    plain = problem_of(data, (), h.values())
    pairs = zip(plain.errors(h.vector), with_law.errors(h.vector), strict=True)
    return [(a - b) / SMALL for a, b in pairs]


@pytest.mark.parametrize(
    ("place", "target", "formula", "signal"),
    [
        (at_joint(0), "joint1", "a*sin(2*theta2)", lambda m: np.sin(2.0 * m.q[:, 1])),
        (
            at_joint(1),
            "joint2",
            "a*cos(theta1)*t",
            lambda m: np.cos(m.q[:, 0]) * (m.time - m.time[0]),
        ),
        (at_tip(1), "tip2", "a*dtheta1", lambda m: m.v[:, 0]),
    ],
)
def test_a_signal_answers_as_its_law(place, target, formula, signal) -> None:
    model = fitted()
    along = [signal(motion) for motion, _, _ in model.refit.problem.motions()]
    (found,) = responses(model, Probe(place), [along])
    for a, b in zip(found, answer(model, target, formula), strict=True):
        assert np.linalg.norm(a - b) < HELD * np.linalg.norm(b)


def test_answers_add_up() -> None:
    model = fitted()
    motions = [motion for motion, _, _ in model.refit.problem.motions()]
    one, other = ([m.q[:, 0] for m in motions], [m.v[:, 1] for m in motions])
    both = [a + b for a, b in zip(one, other, strict=True)]
    x, y, total = responses(model, Probe(at_joint(0)), [one, other, both])
    for a, b, c in zip(x, y, total, strict=True):
        assert np.linalg.norm(a + b - c) < 1e-2 * np.linalg.norm(c)
