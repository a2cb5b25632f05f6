"""A line in the spectrum is a machine's only where nothing else can have made it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flexgui.core.diagnose.remaining_error import remaining_error
from flexgui.core.effects import effect
from flexgui.core.effects.sizes import typical
from flexgui.core.estimate.problem import FitData, Problem, problem_of
from flexgui.core.identify.prepared_recording import Prepared, prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.model import Model
from flexgui.core.recording.velocity import ZeroPhaseLowPass
from flexgui.core.results import ABOVE
from flexgui.core.sensors import sensor
from flexgui.core.simulate.posture import posture, vibration_modes
from flexgui.core.vibration_lines import LEAST_LINE_SHARE, Line, lines_of, unexplained_line
from tests.helpers import PAPER, looped, with_modes
from tests.noise.floors import BARE, clean

SECONDS, DT = 2.0, 1e-3
TIME = np.arange(int(SECONDS / DT)) * DT
OUTPUTS = [sensor("z"), sensor("encoder")]

MACHINE = 13.7
"""Hz: neither a multiple of half the references' pace (25 Hz) nor near a resonance."""

NEAR = 0.5
"""Hz: the recordings' own width."""

FALSE_ALARMS = 2
"""Of 400 spectra of noise, where one in ten thousand is allowed for each."""


@cache
def prepared(cutoff: float | None = None, decimate: int = 1, still: bool = False) -> Prepared:
    recording = clean(DT, SECONDS, "prbs", 1)
    low_pass = None if cutoff is None else ZeroPhaseLowPass(cutoff_hz=cutoff)
    made = prepare(BARE, recording, OUTPUTS, Processing(low_pass, decimate))
    return with_references(made, np.zeros((len(TIME), 2))) if still else made


def with_references(e: Prepared, references: np.ndarray) -> Prepared:
    return replace(e, task=replace(e.task, references=references))


def errors_with(
    e: Prepared, *waves: tuple[float, float], seed: int = 1, noise: float = 1.0
) -> np.ndarray:
    """(M, 4) in floors: noise, and waves of (Hz, amplitude) in z1, through the filters."""
    rng = np.random.default_rng(seed)
    block = noise * rng.standard_normal((len(TIME), 4))
    for hz, size in waves:
        block[:, 0] += size * np.sin(2.0 * np.pi * hz * TIME + 0.4)
    return e.processing.apply(block, DT)


def fitted(model: Model, e: Prepared) -> Problem:
    """A model at its own values, as something that was fitted."""
    ones = (np.ones(len(e.channels)),)
    bare = model.bare or model
    data = FitData(bare, (e,), (), ones, {}, {}, typical(PAPER), 1)
    return problem_of(data, model.effects, model.effect_values)


def found(e: Prepared, errors: np.ndarray, model: Problem | None = None) -> float | None:
    """Hz of the line that is told."""
    one = unexplained_line([e], [errors], model, ABOVE)
    assert one is None or one.channel == "z1"
    return None if one is None else one.line.hz


def test_a_machine_nearby_is_told_with_its_frequency():
    e = prepared()
    assert found(e, errors_with(e, (MACHINE, 3.0))) == pytest.approx(MACHINE, abs=NEAR)
    model = fitted(BARE, e)
    assert found(e, errors_with(e, (MACHINE, 3.0)), model) == pytest.approx(MACHINE, abs=NEAR)


def red(seed: int, e: Prepared) -> np.ndarray:
    """(M, 4) what a model misses slowly: noise that wanders, as after a friction that sticks."""
    steps = np.random.default_rng(seed).standard_normal((len(TIME), 4))
    wandering = np.cumsum(steps, axis=0)
    return e.processing.apply(3.0 * (wandering - wandering.mean(axis=0)) / wandering.std(), DT)


@pytest.mark.long
def test_an_error_that_wanders_is_no_machine():
    e = prepared(still=True)
    assert sum(found_anywhere(e, red(seed, e)) for seed in range(100)) <= FALSE_ALARMS


def test_a_few_swings_are_no_machine():
    e = prepared(still=True)
    assert found(e, errors_with(e, (1.5, 3.0))) is None


def test_decimation_does_not_move_it():
    e = prepared(decimate=5)
    assert found(e, errors_with(e, (MACHINE, 3.0))) == pytest.approx(MACHINE, abs=NEAR)


def test_a_slow_cameras_line_has_its_own_frequency():
    e = prepared()
    counted = e.counted.copy()
    counted[:, :2] = (np.arange(len(TIME)) % 5 == 0)[:, None]
    slow = replace(e, counted=counted)
    assert found(slow, errors_with(e, (MACHINE, 3.0))) == pytest.approx(MACHINE, abs=NEAR)


@pytest.mark.long
def test_noise_holds_none():
    e = prepared()
    told = (found_anywhere(e, errors_with(e, seed=seed, noise=2.0)) for seed in range(100))
    assert sum(told) <= FALSE_ALARMS


def surest_line(x: np.ndarray) -> Line:
    """The most significant line of x (N,)."""
    return min(lines_of(x, DT), key=lambda line: line.chance)


def test_noise_has_a_line_of_one_per_cent_chance_in_one_of_a_hundred_series() -> None:
    """The chance took the background, a median of 51 ordinates, as exactly known."""
    rng = np.random.default_rng(250)
    lines = [surest_line(rng.standard_normal(250)) for _ in range(600)]
    assert sum(line.chance < 0.01 for line in lines) <= 12


def test_within_the_floor_nothing_is_told():
    e = prepared()
    assert found(e, 0.3 * errors_with(e, (MACHINE, 2.0))) is None


def found_anywhere(e: Prepared, errors: np.ndarray) -> bool:
    return unexplained_line([e], [errors], None, ABOVE) is not None


def test_outside_the_outputs_band_nothing_is_told():
    """What a filter leaves of it beyond the cut-off is high above everything beside it."""
    e = prepared(cutoff=12.0)
    block = errors_with(e, (MACHINE, 40.0), noise=0.1)
    assert surest_line(block[:, 0]).chance < 1e-4
    assert found(e, block) is None
    wide = prepared(cutoff=40.0)
    assert found(wide, errors_with(wide, (MACHINE, 40.0))) == pytest.approx(MACHINE, abs=NEAR)


@pytest.mark.parametrize(
    ("share", "told"), [(0.003, False), (0.5 * LEAST_LINE_SHARE, False), (0.5, True)]
)
def test_only_a_relevant_share_of_what_is_left_is_told(share, told):
    """Slow waves make up the rest: what a model lacks, not noise."""
    e = prepared()
    rng = np.random.default_rng(3)
    rest = ZeroPhaseLowPass(cutoff_hz=4.0).apply(rng.standard_normal(len(TIME)), DT)
    rest *= 20.0 / rest.std()
    block = errors_with(e, (MACHINE, 20.0 * np.sqrt(2.0 * share / (1.0 - share))))
    block[:, 0] += rest
    line = surest_line(block[:, 0])
    assert line.chance < 1e-4
    assert line.share == pytest.approx(share, rel=0.5)
    assert (found(e, block) is not None) == told


@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_a_harmonic_of_a_reference_is_no_machine(n):
    references = np.column_stack([np.sin(2.0 * np.pi * 2.9 * TIME), np.zeros(len(TIME))])
    e = with_references(prepared(), references)
    assert found(e, errors_with(e, (n * 2.9, 3.0))) is None
    assert found(e, errors_with(e, (MACHINE, 3.0))) == pytest.approx(MACHINE, abs=NEAR)


def test_sums_and_differences_of_references_are_no_machine():
    waves = [np.sin(2.0 * np.pi * hz * TIME) for hz in (3.3, 17.9)]
    e = with_references(prepared(), np.column_stack(waves))
    for hz in (14.6, 21.2):
        assert found(e, errors_with(e, (hz, 3.0))) is None


@pytest.mark.parametrize("hz", [25.0, 50.0, 75.0])
def test_the_pace_of_held_references_is_no_machine(hz):
    e = prepared()
    assert found(e, errors_with(e, (hz, 3.0))) is None
    still = prepared(still=True)
    assert found(still, errors_with(still, (hz, 3.0))) == pytest.approx(hz, abs=NEAR)


def test_what_comes_back_with_each_cycle_is_no_machine():
    """Three cycles of a motion in which every joint moves at all frequencies."""
    rng = np.random.default_rng(2)
    cycle = ZeroPhaseLowPass(cutoff_hz=30.0).apply(rng.standard_normal(600), DT)
    references = np.column_stack([np.tile(cycle, 4)[: len(TIME)]] * 2)
    e = with_references(prepared(), references)
    again, beside = 12.0 / 0.6, 12.4 / 0.6
    assert found(e, errors_with(e, (again, 3.0))) is None
    assert found(e, errors_with(e, (beside, 3.0))) == pytest.approx(beside, abs=2.0 * NEAR)


def test_where_the_fitted_model_rings_nothing_is_told():
    e = prepared()
    bending = looped(with_modes(2, 2))
    modes = vibration_modes(posture(bending, np.array([0.0, 1.2])))
    rings = [m.frequency for m in modes if m.damping < 0.2]
    hz = next(x for x in rings if abs(x - 25.0 * round(x / 25.0)) > 2.0)
    block = errors_with(e, (hz, 3.0))
    assert found(e, block) == pytest.approx(hz, abs=NEAR)
    assert found(e, block, fitted(bending, e)) is None


def test_the_resonance_of_a_spring_that_was_just_added_is_no_machine():
    e = prepared()
    springs = {"c1": 1 / 3000.0, "c2": 1 / 700.0, "Jh1": 0.1, "Jh2": 0.05}
    soft = BARE.with_effects([effect("joint_elasticity")], springs)
    plain = {m.frequency for m in vibration_modes(posture(BARE, np.array([0.0, 1.2])))}
    new = [
        m.frequency
        for m in vibration_modes(posture(soft, np.array([0.0, 1.2])))
        if m.damping < 0.2
        and min(abs(m.frequency / x - 1.0) for x in plain) > 0.15
        and abs(m.frequency - 25.0 * round(m.frequency / 25.0)) > 2.0
    ]
    block = errors_with(e, (new[0], 3.0))
    assert found(e, block, fitted(BARE, e)) == pytest.approx(new[0], abs=NEAR)
    assert found(e, block, fitted(soft, e)) is None


def test_what_remains_says_the_line_and_its_channel():
    e = prepared()
    left = remaining_error(only(e), [errors_with(e, (MACHINE, 3.0))], fitted(BARE, e))
    assert left.line is not None and left.line[0] == "z1"
    assert left.line[1] == pytest.approx(MACHINE, abs=NEAR)
    assert remaining_error(only(e), [errors_with(e)]).line is None


def only(e: Prepared) -> Any:
    """Data of one recording, with floors that are known."""
    return SimpleNamespace(experiments=[e], floor_uncertainty={}, law_errors={}, tolerances={})
