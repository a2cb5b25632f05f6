"""Disturbances outside the catalogue: what they are, and that no plug-in knows them."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from flexgui.core.effects import catalogue
from flexgui.core.forces.compiled import compile_law
from flexgui.core.simulate.batch import run
from flexgui.core.study.detectability import CLOSE
from tests.studies.plain_matrix_hidden import STRONG, Sight
from tests.studies.plain_matrix_outside import CABLE, OUTSIDE, PIECES, disturbed, in_pieces
from tests.studies.plain_matrix_rigs import STEPS_HZ, drawn

ROUNDING = 1e-12
"""rad and m; pieces and the whole take the same steps."""


@cache
def sight() -> Sight:
    return Sight(drawn(6))


@pytest.mark.parametrize("kind", OUTSIDE)
def test_a_disturbance_shows_as_much_as_was_asked_for(kind: str) -> None:
    recordings, level = disturbed(sight(), kind, np.random.default_rng(1))
    assert STRONG[0] / (1.0 + CLOSE) < level < STRONG[1] * (1.0 + CLOSE)
    assert sight().seen(recordings[: len(sight().plain.experiments)]) == pytest.approx(level)


def test_none_of_them_is_in_the_catalogue() -> None:
    assert not set(OUTSIDE) & set(catalogue())


def test_pieces_of_one_stiffness_are_the_whole() -> None:
    rig = sight().bench
    model, task = rig.healthy, rig.task(rig.healthy, 0)
    whole = run(model, model.numbers(), task, int(np.ceil(STEPS_HZ / rig.rate)))
    pieces = in_pieces(rig, task, np.ones(PIECES))
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
