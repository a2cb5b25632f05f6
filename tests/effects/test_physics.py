"""Units, energy, slopes and the linear model of every effect in the folder."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from flexgui.core.effects import effect
from flexgui.core.forces.compiled import compile_law
from flexgui.core.forces.element import Element
from flexgui.core.model import Model
from flexgui.core.simulate.linear import respond
from tests.effects.dimensions import consistent
from tests.effects.helpers import (
    KINDS,
    base_for,
    experiment,
    parameters_of,
    with_effect,
)
from tests.helpers import PAPER, looped, simulate_fixed, task_from
from tests.simulate.test_integrator import energy_and_momentum

ROUNDING = 1e-12
"""Relative, of a sum of a few products."""


@cache
def elements(kind: str) -> tuple[Element, ...]:
    """Of the effect with what it includes, at plausible sizes."""
    return with_effect(kind, base_for(effect(kind))).numbers().elements


FORCED = [kind for kind in KINDS if elements(kind)]
DISSIPATIVE = [kind for kind in KINDS if effect(kind).dissipative]
LINEAR = [kind for kind in KINDS if effect(kind).linear]


@pytest.mark.parametrize("kind", FORCED)
def test_units_of_the_formula_balance(kind: str) -> None:
    """Every parameter has a value of its own here, so that its number in an element betrays it."""
    parts = [effect(part) for part in (*effect(kind).includes, kind)]
    quantities = [quantity for part in parts for quantity in parameters_of(part)]
    values = {
        k.parameter.name: k.parameter.value * (1.0 + 0.01 * i) for i, k in enumerate(quantities)
    }
    model = with_effect(kind, base_for(effect(kind)), values)
    units = {values[k.parameter.name]: k.parameter.unit for k in quantities}
    found = model.numbers().elements
    assert found and any(value in units for one in found for value in one.values)
    for one in found:
        assert consistent(one, model.arm, units)


def test_a_wrong_unit_is_noticed() -> None:
    """The check itself: a friction in N m is no friction in N m s/rad."""
    model = with_effect("viscous_friction", looped(PAPER))
    (one, *_) = model.numbers().elements
    assert consistent(one, model.arm, {one.values[0]: "N m s/rad"})
    assert not consistent(one, model.arm, {one.values[0]: "N m"})


sizes_of_all_magnitudes = st.floats(-4.0, 0.5).map(lambda e: 10.0**e)
numbers = st.builds(
    lambda sign, size: sign * size, st.sampled_from([-1.0, 1.0]), sizes_of_all_magnitudes
)


@pytest.mark.parametrize("kind", FORCED)
@given(data=st.data())
def test_compiled_slopes_are_those_of_the_compiled_forces(kind: str, data) -> None:  # type: ignore[no-untyped-def]
    one = data.draw(st.sampled_from(elements(kind)))
    k, m = len(one.law.x), len(one.law.states)
    x, v = (np.array(data.draw(st.lists(numbers, min_size=k, max_size=k))) for _ in range(2))
    w = np.array(data.draw(st.lists(numbers, min_size=m, max_size=m)))
    compiled, e = compile_law(one.law), np.array(one.values)
    out = compiled(x, v, w, e)

    def differences(which: int, i: int) -> tuple[np.ndarray, np.ndarray]:
        """Slopes of all outputs to the right and to the left."""
        point = [x.copy(), v.copy(), w.copy()]
        step = 1e-6 * abs(point[which][i])
        sides = []
        for sign in (1.0, -1.0):
            point[which][i] += sign * step
            sides.append((compiled(*point, e) - out) / (sign * step))
            point[which][i] -= sign * step
        return sides[0], sides[1]

    for i in range(k):
        _agrees(out[k + i], *[side[i] for side in differences(0, i)], out[i], x[i])
        _agrees(out[2 * k + i], *[side[i] for side in differences(1, i)], out[i], v[i])
    for i in range(m):
        right, left = differences(2, i)
        rate = 3 * k + i
        terms = abs(out[rate]) + abs(w[i] * out[3 * k + 3 * m + i])  # which may cancel
        _agrees(out[3 * k + m + i], right[i], left[i], out[i], w[i])
        _agrees(out[3 * k + 3 * m + i], right[rate], left[rate], terms, w[i])
        right, left = differences(1, i)
        _agrees(out[3 * k + 2 * m + i], right[rate], left[rate], terms, v[i])


NEAR = 1e-4
"""Relative: differences with a step of a millionth, of forces good to sixteen digits."""


def _agrees(slope: float, right: float, left: float, value: float, at: float) -> None:
    size = max(abs(right), abs(left), abs(slope), abs(value / at), 1e-9)
    assume(abs(right - left) < 100.0 * NEAR * size)  # not across a kink
    assert abs(slope - 0.5 * (right + left)) < NEAR * size


@pytest.mark.parametrize("kind", [kind for kind in DISSIPATIVE if elements(kind)])
@pytest.mark.parametrize("seed", range(3))
def test_a_dissipative_force_never_injects_energy(kind: str, seed: int) -> None:
    """From rest, along any motion, the work done on the arm stays negative at all times."""
    rng = np.random.default_rng(seed)
    n = with_effect(kind, base_for(effect(kind))).arm.coordinates
    time = np.arange(3000) * 1e-3
    waves = [rng.normal(0.0, 1.0, n)[:, None] * np.sin(f * time + rng.uniform(0.0, 6.0))
             for f in rng.uniform(1.0, 30.0, 4)]  # fmt: skip
    q = 0.05 * np.sum(waves, axis=0)
    v = np.gradient(q, time, axis=1)
    work = np.zeros(len(time))
    for one in elements(kind):
        work += _work(one, q, v, 1e-3)
    assert np.all(work <= ROUNDING)
    assert work[-1] < 0.0


LOAD = 7.0
"""N m that a drive gives all the time, where a friction depends on it."""


def _work(one: Element, q: np.ndarray, v: np.ndarray, dt: float) -> np.ndarray:
    """J done up to each sample; the ports at the tip move like the first two coordinates."""
    rows = one.rows(len(q))
    if one.at_tip:
        rows = rows.copy()
        rows[:2] = np.eye(2, len(q))
    compiled, k, m = compile_law(one.law), len(one.law.x), len(one.law.states)
    w, e = np.zeros(m), np.array(one.values)
    if one.loads:
        e[-1] = LOAD
    power = np.empty(q.shape[1])
    for i in range(len(power)):
        speed = rows @ v[:, i]
        out = compiled(rows @ q[:, i], speed, w, e)
        power[i] = out[:k] @ speed
        w = w + dt * out[3 * k : 3 * k + m] / (1.0 - dt * out[3 * k + 3 * m :])
    return np.cumsum(power) * dt


COAST_GROWTH = 1e-9
"""Of the energy at the start, between two looks: the integrator's own error."""


BY_ITSELF = [k for k in DISSIPATIVE if not any(one.loads for one in elements(k))]
"""Without what rubs only where a drive gives a torque."""


@pytest.mark.parametrize("kind", BY_ITSELF)
def test_a_coasting_arm_with_a_dissipative_effect_only_loses_energy(kind: str) -> None:
    base = looped(PAPER, gain=0.0)
    model = with_effect(kind, base)
    n = model.arm.coordinates
    start = np.zeros(2 * n)
    start[:4], start[n : n + 2] = (0.3, 1.2, 0.02, -0.02), (0.5, -0.3)
    task = task_from(model, start, np.zeros((401, 2)))
    motion = simulate_fixed(model, model.numbers(), task, 64)
    total, _, _ = energy_and_momentum(motion)
    stored = any(one.law.states for one in model.numbers().elements)
    gained = total - total[0] if stored else np.diff(total)
    assert gained.max() <= COAST_GROWTH * total[0]
    assert total[-1] < 0.9999 * total[0]


SMALL = 1e-3
"""Times the usual excitation: what is not linear then is a thousandth of what is."""

LINEAR_SHARE = 2e-3
"""Of the motion's own size, at that excitation."""


@pytest.mark.parametrize("kind", LINEAR)
def test_the_linear_model_is_the_limit_of_the_nonlinear_one(kind: str) -> None:
    """The part of the motion that the excitation causes, as joints and modes move it."""
    base = looped(PAPER, level="lpv")
    model = with_effect(kind, base)
    assert model.level == "lpv"
    linear, exact = (_caused(model, level) for level in ("lpv", "nonlinear"))
    for name, y in exact.items():
        assert np.abs(linear[name] - y).max() < LINEAR_SHARE * np.abs(y).max(), name


@pytest.mark.parametrize("kind", [kind for kind in KINDS if not effect(kind).linear])
def test_an_effect_that_is_not_linear_makes_the_model_nonlinear(kind: str) -> None:
    assert with_effect(kind, looped(PAPER, level="lpv")).level == "nonlinear"


def _caused(model: Model, level: str) -> dict[str, np.ndarray]:
    """Coordinates and torque of a small excitation, less those without one."""
    model = model.at_level(level)
    found = []
    for amplitude in (0.3 * SMALL, 0.3e-9):
        task = experiment(model, seconds=0.3, amplitude=amplitude)
        if level == "lpv":
            motion = respond(model, [model.numbers()], [task])[0]
        else:
            motion = simulate_fixed(model, model.numbers(), task, 16)
        seen = {"q": motion.q, "torque": motion.torque}
        dt = task.sample_time
        seen |= {s: model.sensed(s, y, dt, {}) for s, y in (("encoder", motion.joint_positions),)}
        found.append(seen)
    return {name: found[0][name] - found[1][name] for name in found[0]}
