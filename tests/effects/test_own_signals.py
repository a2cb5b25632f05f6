"""Own formulas with tables, dry friction, hysteresis, and signals of a recording."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from flexgui.core.drives.servo import FollowingServo
from flexgui.core.drives.torque import Torque
from flexgui.core.effects import effect
from flexgui.core.effects.own import OwnEffect, own_effect
from flexgui.core.effects.own_formula import own_parameter
from flexgui.core.errors import InputError
from flexgui.core.forces.compiled import compile_law
from flexgui.core.identify.predictor import motion_of
from flexgui.core.identify.prepared_recording import prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.model import Model
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.sensors import sensor
from flexgui.core.simulate.experiment import make_task, simulate_recording
from tests.effects.test_own import motion, own
from tests.helpers import PAPER, chain, looped

SAME = 1e-9
"""rad or m, in motions of some tenths, of one law that is stated in two ways."""

ROUNDING = 1e-12


@pytest.mark.parametrize(
    ("formula", "kind", "values"),
    [
        ("-a*friction(theta2)", "coulomb_friction", {"fc1": 0.0, "fc2": 0.5}),
        (
            "-a*abs(u2)*friction(theta2)", "load_friction",
            {"ld1": 0.0, "lb1": 0.0, "ld2": 0.5, "lb2": 0.5},
        ),
    ],
)  # fmt: skip
def test_friction_as_a_formula_is_that_of_the_list(
    formula: str, kind: str, values: Mapping[str, float]
) -> None:
    listed = motion(looped(PAPER).with_effects([effect(kind)], values))
    stated = motion(looped(PAPER).with_effects([own("joint2", formula, a=0.5)]))
    assert np.abs(stated - listed).max() < SAME
    assert np.abs(stated - motion(looped(PAPER))).max() > 1e3 * SAME


@pytest.mark.parametrize("name", ["w", "x", "q"])
def test_a_parameter_beside_a_friction_may_have_any_name(name: str) -> None:
    """What laws are written in inside has other names."""
    text = "-a*exp(-abs(u2)/{0})*friction(theta2)"
    one = own("joint2", text.format(name), a=0.5, **{name: 40.0})
    other = own("joint2", text.format("k"), a=0.5, k=40.0)
    values = {p.parameter.name: p.parameter.value for p in one.own_parameters}
    assert values == {"a": 0.5, name: 40.0}
    moved = [motion(looped(PAPER).with_effects([each])) for each in (one, other)]
    assert np.abs(moved[0] - moved[1]).max() < ROUNDING


def force(one: OwnEffect, place: float, *written: float) -> float:
    """At a place of the first port, at rest."""
    law = compile_law(one.stated)
    x = np.zeros(len(one.ports))
    x[0] = place
    values = [p.parameter.value for p in one.own_parameters]
    out = law(x, np.zeros(len(x)), np.zeros(len(one.stated.states)), np.array([*values, *written]))
    return float(out[0])


VALUES = {"a1": 0.3, "a2": -1.0, "a3": 2.0, "a4": 0.5, "a5": 0.0}
LISTED = ", ".join(VALUES)


def test_a_spline_passes_through_its_values_and_stays_beyond() -> None:
    one = own("joint1", f"spline(theta1, -1, 1, {LISTED})", **VALUES)
    found = [force(one, place) for place in np.linspace(-1.0, 1.0, 5)]
    assert found == pytest.approx(list(VALUES.values()), abs=ROUNDING)
    assert force(one, 3.0) == pytest.approx(VALUES["a5"], abs=ROUNDING)
    assert force(one, -3.0) == pytest.approx(VALUES["a1"], abs=ROUNDING)


@pytest.mark.parametrize("turns", [-1, 0, 2])
def test_a_periodic_table_passes_through_its_values_in_every_turn(turns: int) -> None:
    one = own("joint1", f"periodic(theta1, {LISTED})", **VALUES)
    places = 2.0 * np.pi * (np.arange(5) / 5 + turns)
    assert [force(one, x) for x in places] == pytest.approx(list(VALUES.values()), abs=1e-9)


@pytest.mark.parametrize("table", ["spline(theta1, -1, 1, {})", "periodic(theta1, {})"])
def test_a_table_of_equal_values_is_constant(table: str) -> None:
    one = own("joint1", table.format(LISTED), **dict.fromkeys(VALUES, 1.7))
    for place in np.linspace(-1.0, 1.0, 23):
        assert force(one, place) == pytest.approx(1.7, abs=1e-9)


def test_hysteresis_turns_over_its_way() -> None:
    """u = 1 - 2 exp(-x / s) after a reversal at u = -1."""
    law = compile_law(own("joint1", "-a*hysteresis(theta1, s)", a=2.0, s=0.1).stated)
    share, step = -1.0, 1e-5
    for _ in range(int(0.2 / step)):
        out = law(np.zeros(1), np.ones(1), np.array([share]), np.array([2.0, 0.1]))
        share += step * out[3]
    assert share == pytest.approx(1.0 - 2.0 * np.exp(-2.0), abs=1e-4)


def recorded(**columns: np.ndarray) -> Recording:
    spec = SimulateSpec(theta2=1.0, seconds=0.3)
    found = simulate_recording(looped(PAPER), spec, "r")
    return Recording("r", found.time, {**found.channels, **columns}, theta2=1.0)


def test_time_and_a_column_that_says_the_same_do_the_same() -> None:
    time = recorded().time
    recording = recorded(input2=np.where(np.arange(len(time)) % 3, np.nan, time))
    recording.channels["input2"][-1] = time[-1]
    found = []
    for one in (own("joint1", "a*t", a=9.0), own("joint1", "a*input2", a=9.0)):
        model = looped(PAPER).with_effects([one])
        e = prepare(model, recording, [sensor("z")], Processing())
        found.append(motion_of(e, model.numbers(), {}, 4).q)
    assert np.abs(found[0] - found[1]).max() < SAME
    plain = prepare(looped(PAPER), recording, [sensor("z")], Processing())
    without = motion_of(plain, plain.model.numbers(), {}, 4).q
    assert np.abs(found[0] - without).max() > 1e-3


def test_along_a_prescribed_motion_a_force_over_time_is_added_to_the_torque() -> None:
    arm = chain(0)
    time = np.arange(400) * 1e-3
    place = 0.2 * np.sin(12.0 * time)
    recording = Recording("r", time, {"u1": 0.0 * time, "theta1": place})
    plain = Model(arm, Torque(), "nonlinear").steered_by(FollowingServo(Torque(), 60.0, (0.3,)))
    (a,) = (own_parameter("a", 5.0),)
    one = own_effect(arm, "joint1", "-a*t", (a,), "own_1")
    torques = []
    for model in (plain, plain.with_effects([one])):
        e = prepare(model, recording, [sensor("torque")], Processing())
        torques.append(motion_of(e, model.numbers(), {}, 2).torque[:, 0])
    assert torques[1] - torques[0] == pytest.approx(5.0 * time, abs=1e-6)


def test_a_recording_without_the_column_is_refused() -> None:
    model = looped(PAPER).with_effects([own("joint1", "a*input2", a=1.0)])
    with pytest.raises(InputError, match="Recording r has no column input2"):
        prepare(model, recorded(), [sensor("z")], Processing())
    with pytest.raises(InputError, match="has no column input2"):
        make_task(model, SimulateSpec(theta2=1.0, seconds=0.3), "r")
