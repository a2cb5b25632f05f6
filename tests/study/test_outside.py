"""Disturbances outside the catalogue: what they are, and that no plug-in knows them."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.effects import catalogue
from flexgui.core.forces.compiled import compile_law
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.simulate.batch import run
from flexgui.core.study.detectability import CLOSE, Detectability
from flexgui.core.study.study_rig import STEPS, Experiment, bare_model
from tests.studies.outside import CABLE, OUTSIDE, PIECES, STRONG, disturbed, in_pieces

EXPERIMENTS = [Experiment("r", SimulateSpec(theta2=1.2, seconds=0.4, seed=1))]

ROUNDING = 1e-12
"""rad and m; pieces and the whole take the same steps."""


@pytest.mark.parametrize("kind", OUTSIDE)
def test_a_disturbance_shows_as_much_as_was_asked_for(kind: str) -> None:
    detectability = Detectability(bare_model(), EXPERIMENTS)
    found = disturbed(kind, detectability, STRONG, np.random.default_rng(1))
    assert found.level == pytest.approx(STRONG, rel=CLOSE)
    assert detectability.seen(found.outputs) == pytest.approx(found.level, rel=1e-9)


def test_none_of_them_is_in_the_catalogue() -> None:
    assert not set(OUTSIDE) & set(catalogue())


def test_pieces_of_one_stiffness_are_the_whole() -> None:
    model = bare_model()
    task = EXPERIMENTS[0].task(model)
    whole = run(model, model.numbers(), task, STEPS)
    pieces = in_pieces(model, task, np.ones(PIECES))
    assert np.abs(whole.q - pieces.q).max() < ROUNDING
    assert np.abs(whole.v - pieces.v).max() < 1e3 * ROUNDING  # rates are as much larger


def test_the_cable_loses_energy_in_a_closed_loop_and_holds_its_break_away_force() -> None:
    law = compile_law(CABLE)
    stiffness, breaks = 50.0, 0.02
    w, work, forces = 0.0, 0.0, []
    steps = 20_000
    t = np.linspace(0.0, 4.0 * np.pi, steps)
    x = 0.1 * np.sin(t)
    for k in range(steps - 1):
        v = x[k + 1] - x[k]
        out = law(x[k : k + 1], np.array([v]), np.array([w]), np.array([stiffness, breaks]))
        forces.append(out[0])
        work += out[0] * v
        w += out[3]
    assert work < 0.0
    limit = stiffness * breaks
    assert np.abs(forces).max() == pytest.approx(limit, rel=0.02)
