"""Disturbances outside the catalogue: what they are, that no plug-in knows them; their noise."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from flexgui.core.effects import catalogue
from flexgui.core.forces.compiled import compile_law
from flexgui.core.simulate.batch import run
from flexgui.core.study.detectability import CLOSE
from flexgui.core.study.study_rig import AR_COEFFICIENT, AR_COEFFICIENTS, noise
from tests.programs.studies.plain_matrix_hidden import STRONG, Sight
from tests.programs.studies.plain_matrix_outside import CABLE, OUTSIDE, PIECES, disturbed, in_pieces
from tests.programs.studies.plain_matrix_rigs import STEPS_HZ, drawn

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


SAMPLES = 200_000
SCATTER = 0.02
"""Relative; a coloured sequence of this length has about 10 000 independent samples."""


@pytest.mark.parametrize("colour", AR_COEFFICIENTS.values())
def test_both_colours_have_the_stated_deviation(colour: float) -> None:
    x = noise(np.random.default_rng(1), SAMPLES, 3e-5, colour)
    assert np.std(x) == pytest.approx(3e-5, rel=SCATTER)


@pytest.mark.parametrize("dt", [0.5e-3, 1e-3, 4e-3])
def test_the_memory_is_one_of_time_not_of_samples(dt: float) -> None:
    x = noise(np.random.default_rng(1), SAMPLES, 1.0, AR_COEFFICIENT, dt)
    next_to_each_other = np.mean(x[1:] * x[:-1])
    assert next_to_each_other == pytest.approx(AR_COEFFICIENT ** (dt / 1e-3), abs=SCATTER)


def test_coloured_noise_is_stationary_from_the_first_sample_on() -> None:
    rng = np.random.default_rng(1)
    first = np.array([noise(rng, 20, 1.0, AR_COEFFICIENT) for _ in range(5000)])
    assert np.allclose(first.std(axis=0), 1.0, atol=0.06)  # 1 % scatter per column, 20 of them
