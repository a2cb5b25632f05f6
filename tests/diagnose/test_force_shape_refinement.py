"""The second look at a shape: which order a wave has, though the working points alias it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexgui.core.challenge.challenge_rig import bare_model
from flexgui.core.diagnose.force_shape_refinement import (
    JointForce,
    best_force_shape,
    force_shape_peaks,
    joint_force_shape,
    refine_force_shape,
)
from flexgui.core.diagnose.gram_matrix import gram_matrix
from flexgui.core.diagnose.output_changes import OutputChange
from flexgui.core.effects import effect
from flexgui.core.effects.sizes import Sizes, typical
from flexgui.core.effects.torque_ripple import every_order
from flexgui.core.estimate.fit_result import FitResult, fit
from flexgui.core.estimate.problem import FitData, problem_of
from flexgui.core.missing_torque import FIRST_FREQUENCY, ErrorResponse
from flexgui.core.noise.whitening import no_whitening
from tests.diagnose import fits

SAMPLES, DT = 2000, 1e-3
TRAVEL, APART = 0.02, 0.4
"""rad: of one recording, and between the working points."""

TRUE = {"ra2": 0.03, "rb2": -0.02, "nr2": 700.0}
NOISE = 0.01
"""Of the wave."""

SIZE = 0.1
"""Relative: the order that is found lies a little beside the true one."""


def motions() -> list[ErrorResponse]:
    """Three working points whose joints answer a torque by the torque itself."""
    rng = np.random.default_rng(5)
    time = DT * np.arange(SAMPLES)
    found = []
    for k in range(3):
        place = np.zeros((SAMPLES, 2))
        tones = [np.sin(2.0 * np.pi * hz * time + rng.uniform(0, 6.0)) for hz in (0.7, 1.9, 3.1)]
        place[:, 1] = 0.3 + APART * k + TRAVEL / 4.0 * np.sum(tones, axis=0)
        x = TRUE["nr2"] * place[:, 1]
        torque = TRUE["ra2"] * np.cos(x) + TRUE["rb2"] * np.sin(x)
        error = torque[:, None] + NOISE * np.ptp(torque) * rng.standard_normal((SAMPLES, 1))
        answer = np.zeros((SAMPLES // 2 + 1 - FIRST_FREQUENCY, 1, 2))
        answer[:, 0, 1] = 1.0
        found.append(ErrorResponse(place, np.gradient(place, DT, axis=0), error, answer))
    return found


def sizes() -> Sizes:
    two = np.ones(2)
    return replace(typical(bare_model().arm), travel=TRAVEL * two, span=(2 * APART + TRAVEL) * two)


def tried(kind: str = "torque_ripple", names: tuple[str, str] = ("r", "nr2")) -> JointForce:
    model, one = bare_model(), effect(kind)
    effect_parameters = one.parameters(model.arm, model.drive, sizes())
    shape = next(k for k in effect_parameters if k.parameter.name == names[1])
    mine = [
        k
        for k in effect_parameters
        if k.parameter.name[0] == names[0] and k.parameter.name[-1] == "2"
    ]
    values = {k.parameter.name: k.neutral for k in effect_parameters}
    return JointForce(one, model, values, tuple(mine), shape)


def test_the_order_of_a_wave_is_found_among_its_aliases() -> None:
    best = force_shape_peaks(tried(), motions(), most=3)
    assert len(best) == 3
    apart = 2.0 * np.pi / APART
    assert abs(best[0]["nr2"] - TRUE["nr2"]) < apart / 10.0
    assert abs(best[1]["nr2"] - TRUE["nr2"]) == pytest.approx(apart, rel=SIZE)


def test_the_wave_comes_with_its_sizes() -> None:
    best = force_shape_peaks(tried(), motions(), most=1)[0]
    amplitude = np.hypot(best["ra2"], best["rb2"])
    assert amplitude == pytest.approx(np.hypot(TRUE["ra2"], TRUE["rb2"]), rel=SIZE)


def test_friction_with_a_memory_has_no_shape_along_the_motion() -> None:
    stribeck = tried("stribeck_friction", ("f", "vs2"))
    shaped = replace(stribeck, shape=replace(stribeck.shape, fine_grid=stribeck.shape.grid))
    assert force_shape_peaks(shaped, motions(), most=3) == []


def test_orders_lie_close_enough_over_all_positions() -> None:
    grid = (300.0, 450.0, 750.0, 1200.0)
    steps = np.diff(every_order(grid, span=0.8))
    assert np.all(steps * 0.8 <= 0.5 * np.pi * 1.01)


def with_a_filter(stated: bool = True) -> tuple[FitData, FitResult]:
    """Short recordings with a ripple at three working points, fitted from wrong orders; `stated`:
    whether they say at which."""
    hidden = {"torque_ripple": dict(RIPPLE)}
    scenario = fits.on_paper(
        sensors={"encoder_noise": 2e-6},
        identify={"parameters": ["EI"], "output": ["encoder"], "filter": {"cutoff_hz": CUTOFF}},
        recordings=[
            {"simulate": {"theta2": x, "seconds": 0.6}, "hidden": hidden} for x in (0.6, 1.0, 1.4)
        ],
    )
    setup, recordings = fits.set_up(scenario)
    if not stated:
        recordings = [replace(r, theta2=None) for r in recordings]
    found = fits.fitted(setup, recordings, scenario, {"theta1": 2e-6, "theta2": 2e-6})
    wrong = {**found.base.problem.values(), **RIPPLE, "nr1": WRONG, "nr2": WRONG}
    start = problem_of(found.data, [effect("torque_ripple")], wrong)
    return found.data, fit(start, None, lambda: False, 4)


RIPPLE = {"ra1": 0.08, "rb1": -0.04, "nr1": 610.0, "ra2": 0.04, "rb2": 0.03, "nr2": 780.0}
CUTOFF = 60.0
"""Hz, a sixteenth of the sampling rate."""

WRONG = 400.0
"""Order from which no descent leads to the true ones."""

ORDER = 0.01
"""Relative, of an order from three recordings of 0.6 s."""


@pytest.mark.long
@pytest.mark.parametrize("stated", [True, False], ids=["stated", "unstated"])
def test_the_orders_are_found_though_what_is_compared_is_filtered(stated: bool) -> None:
    data, stuck = with_a_filter(stated)
    found = refine_force_shape(data, stuck, effect("torque_ripple"), lambda: False)
    assert found.cost < 0.1 * stuck.cost
    at = found.problem.values()
    assert [at["nr1"], at["nr2"]] == pytest.approx([RIPPLE["nr1"], RIPPLE["nr2"]], rel=ORDER)


ROWS = 400
ORDERS = (3.0, 5.0, 8.0)
TIME = np.linspace(0.0, 2.0 * np.pi, ROWS)
LEFT = 1e-9
"""Of the squared error: it is made of the columns."""


def wave(joint: int, order: float) -> np.ndarray:
    """(M, 2): each joint shows in its own output."""
    block = np.zeros((ROWS, 2))
    block[:, joint - 1] = np.cos(order * TIME)
    return block


def columns() -> list[OutputChange]:
    found = []
    for order in ORDERS:
        shape = (("nr1", order), ("nr2", order))
        for joint in (1, 2):
            parameter = f"ra{joint}"
            found.append(
                OutputChange(
                    effect("torque_ripple"), parameter, {parameter: 1.0, **dict(shape)},
                    {parameter: 1.0}, False, False, shape, (wave(joint, order),),
                )
            )  # fmt: skip
    return found


def test_each_joint_has_its_own_shape() -> None:
    tried = columns()
    errors = [0.7 * wave(1, 3.0) - 0.2 * wave(2, 8.0)]
    slopes = [np.zeros((ROWS, 2, 0))]
    w = gram_matrix(errors, slopes, [c.blocks for c in tried], no_whitening).projected()
    found = best_force_shape(effect("torque_ripple"), tried, w)
    shape: dict[str, float] = {}
    for i in found.chosen:
        shape |= joint_force_shape(tried[i])
    assert shape == {"nr1": 3.0, "nr2": 8.0}
    assert found.explained.cost_reduction >= (1.0 - LEFT) * float(np.sum(errors[0] ** 2))
    assert found.trial_count == len(ORDERS) ** 2


def test_each_joint_of_several_sizes_is_one_choice_among_all_pairs() -> None:
    """Six sizes at each of two joints counted as six choices."""
    sizes = range(1, 7)
    tried = [
        OutputChange(
            effect("backlash"), f"bl{joint}", {f"bl{joint}": float(size)},
            {f"bl{joint}": float(size)}, True, True, (), (wave(joint, float(size)),),
        )
        for joint in (1, 2)
        for size in sizes
    ]  # fmt: skip
    errors, slopes = [wave(1, 3.0) + wave(2, 5.0)], [np.zeros((ROWS, 2, 0))]
    w = gram_matrix(errors, slopes, [c.blocks for c in tried], no_whitening).projected()
    assert best_force_shape(effect("backlash"), tried, w).trial_count == len(sizes) ** 2
