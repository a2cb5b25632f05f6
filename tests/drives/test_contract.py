"""What every drive in the folder must keep; a new file inherits these tests."""

from __future__ import annotations

import inspect

import numpy as np
import pytest

from flexgui.core import drives
from flexgui.core.arm.slots import arm_vector
from flexgui.core.drives import build_drive
from flexgui.core.drives.drive import Drive, drive_classes
from flexgui.core.errors import InputError
from flexgui.core.plugins import modules_of
from flexgui.core.recording.recording import Recording
from tests.helpers import ARMS, PAPER, refusal

OPTIONS = {
    "velocity_loop": {"gains": [60.0, 30.0], "limits": [50.0, 20.0]},
    "torque": {"torque_constants": [1.5, 0.8]},
    "cascade": {"position_gains": [10.0, 8.0], "velocity_gains": [40.0, 20.0]},
    "compensator": {"gains": [300.0, 150.0], "zeros": [10.0, 12.0], "poles": [40.0, 50.0]},
    "state_feedback": {
        "gains": [[50.0, 8.0, 3.0, 0.5], [30.0, 5.0, 2.0, 0.2]],
        "torque_constants": [1.5, 0.8],
        "rate_filter": 300.0,
        "gauge_filter": {"frequency": 200.0, "damping": 0.7},
        "current_limits": [10.0, 5.0],
    },
    "voltage": {"torque_constants": [0.02, 0.01], "resistances": [2.6, 1.3], "gears": [70.0, 20.0]},
    "held": {},
}
"""Settings of each drive for the paper's arm; a new drive adds its line."""

KINDS = sorted(drive_classes())
DRIVEN = [kind for kind in KINDS if kind != "held"]
"""All that a column drives; joints that are held follow their encoders and have no settings."""


def built(kind: str) -> Drive:
    return build_drive(kind, OPTIONS[kind])


def test_every_drive_of_the_folder_is_found_and_has_settings_here() -> None:
    written = {
        thing.kind
        for module in modules_of("flexgui.core.drives")
        for thing in vars(module).values()
        if inspect.isclass(thing) and issubclass(thing, Drive) and thing.kind
    }
    assert written == set(KINDS) == set(OPTIONS)
    assert drives.__doc__


@pytest.mark.parametrize("kind", KINDS)
def test_law_has_consistent_shapes(kind: str) -> None:
    drive = built(kind)
    drive.check(PAPER)
    law = drive.law(PAPER, arm_vector(PAPER), {})
    nj, n, nr, ns = 2, PAPER.coordinates, len(drive.reference_channels(PAPER)), law.states
    shapes = {
        "R": (nj, nr), "P": (nj, n), "V": (nj, n), "S": (nj, ns), "Fs": (ns, ns),
        "Fq": (ns, n), "Fv": (ns, n), "Fr": (ns, nr), "limit": (nj,),
    }  # fmt: skip
    assert {name: getattr(law, name).shape for name in shapes} == shapes
    assert all(np.all(np.isfinite(getattr(law, name))) for name in shapes if name != "limit")
    assert np.all(law.limit > 0.0)


@pytest.mark.parametrize("kind", KINDS)
def test_states_of_a_drive_decay_by_themselves(kind: str) -> None:
    law = built(kind).law(PAPER, arm_vector(PAPER), {})
    assert np.all(np.linalg.eigvals(law.Fs).real < 0.0)


@pytest.mark.parametrize("kind", KINDS)
def test_law_takes_the_values_of_its_parameters(kind: str) -> None:
    drive, p = built(kind), arm_vector(PAPER)
    before = drive.law(PAPER, p, {})
    for item in drive.parameters(PAPER):
        assert item.lower <= item.value <= item.upper
        assert item.symbol and item.title
        same = drive.law(PAPER, p, {item.name: item.value})
        other = drive.law(PAPER, p, {item.name: 1.1 * item.value})
        assert np.array_equal(same.R, before.R)
        assert not np.array_equal(other.R, before.R)


@pytest.mark.parametrize("kind", DRIVEN)
def test_signals_are_the_reference_columns_of_a_recording(kind: str) -> None:
    drive, time = built(kind), np.arange(4) * 1e-3
    names = drive.reference_channels(PAPER)
    columns = {name: np.arange(4.0) + 10.0 * k for k, name in enumerate(names)}
    signals = drive.signals(Recording("r", time, columns), PAPER)
    assert np.array_equal(signals, np.column_stack(list(columns.values())))


@pytest.mark.parametrize("kind", DRIVEN)
def test_a_recording_without_the_references_is_named(kind: str) -> None:
    with pytest.raises(InputError, match=f"r1.*{built(kind).reference_channels(PAPER)[0]}"):
        built(kind).signals(Recording("r1", np.arange(4) * 1e-3, {}), PAPER)


@pytest.mark.parametrize("kind", DRIVEN)
def test_a_drive_for_two_joints_is_refused_by_three(kind: str) -> None:
    with pytest.raises(InputError, match="one per joint"):
        built(kind).check(ARMS["3-3-3"])


@pytest.mark.parametrize("kind", DRIVEN)
def test_an_unknown_setting_is_named_with_the_nearest_known_one(kind: str) -> None:
    setting = next(iter(OPTIONS[kind]))
    said = refusal(lambda: build_drive(kind, {**OPTIONS[kind], setting + "x": 1.0}))
    assert f"{setting}x is not a setting; did you mean {setting!r}?" in said


@pytest.mark.parametrize(
    ("kind", "change", "words"),
    [
        ("velocity_loop", {"gains": [-1.0, 30.0]}, "gains.0"),
        ("velocity_loop", {"gains": [float("nan"), 30.0]}, "gains.0"),
        ("velocity_loop", {"gains": "stiff"}, "gains"),
        ("velocity_loop", {"limits": [0.0, 1.0]}, "limits.0"),
        ("torque", {"torque_constants": [0.0, 1.0]}, "torque_constants.0"),
        ("torque", {"servo_hz": -60.0}, "servo_hz"),
        ("cascade", {"position_gains": [1.0, -1.0]}, "position_gains.1"),
        ("state_feedback", {"gains": [[1.0, 2.0, 3.0]]}, "gains.0"),
        ("state_feedback", {"rate_filter": 0.0}, "rate_filter"),
        ("state_feedback", {"gauge_filter": {"frequency": 10.0}}, "gauge_filter.damping"),
        ("state_feedback", {"torque_constants": [float("inf"), 1.0]}, "torque_constants.0"),
        ("voltage", {"resistances": [0.0, 1.0]}, "resistances.0"),
        ("voltage", {"gears": [-70.0, 20.0]}, "gears.0"),
        ("held", {"gains": [1.0]}, "gains"),
    ],
)
def test_bad_settings_are_said_in_one_line(kind: str, change: dict, words: str) -> None:
    said = refusal(lambda: build_drive(kind, {**OPTIONS[kind], **change}))
    assert said.startswith(f"[drive] {words}")


def test_a_missing_setting_is_named() -> None:
    with pytest.raises(InputError, match=r"^\[drive\] gains"):
        build_drive("velocity_loop", {})


def test_an_unknown_kind_is_named_with_the_nearest_known_one() -> None:
    with pytest.raises(InputError, match="did you mean 'velocity_loop'"):
        build_drive("velocty_loop", {})


def test_back_emf_brakes_as_the_motors_equations_say() -> None:
    """u = N kt i, voltage = Ra i + kt N theta'."""
    law = built("voltage").law(PAPER, arm_vector(PAPER), {})
    N, kt, Ra, voltage, speed = 70.0, 0.02, 2.6, 5.0, 1.5
    current = (voltage - kt * N * speed) / Ra
    assert law.R[0, 0] * voltage - law.V[0, 0] * speed == pytest.approx(N * kt * current)
    assert not built("voltage").holds_joints(law)


@pytest.mark.parametrize("kind", DRIVEN)
def test_a_known_torque_is_added_to_any_drive(kind: str) -> None:
    plain, p = built(kind), arm_vector(PAPER)
    both = build_drive(kind, {**OPTIONS[kind], "known_torque": [2]})
    both.check(PAPER)
    own, law = plain.law(PAPER, p, {}), both.law(PAPER, p, {"kx2": 0.5})
    assert both.reference_channels(PAPER) == (*plain.reference_channels(PAPER), "known_torque2")
    assert np.array_equal(law.R[:, :-1], own.R) and law.R[:, -1].tolist() == [0.0, 0.5]
    assert law.Fr.shape == (own.states, law.references) and np.array_equal(law.V, own.V)
    assert both.holds_joints(law) == plain.holds_joints(own)


@pytest.mark.parametrize(
    ("kind", "stated", "words"),
    [
        ("torque", 1, "list of joints"),
        ("torque", [1, 1], "each once"),
        ("torque", [0], "list of joints"),
        ("held", [1], "follow the encoders"),
    ],
)
def test_a_known_torque_that_has_no_place_is_refused(kind: str, stated, words: str) -> None:
    with pytest.raises(InputError, match=words):
        build_drive(kind, {**OPTIONS[kind], "known_torque": stated})


def test_a_known_torque_of_a_joint_that_is_not_there_is_refused() -> None:
    with pytest.raises(InputError, match="names joint 3; the arm has 2"):
        build_drive("torque", {"known_torque": [3]}).check(PAPER)


@pytest.mark.parametrize("kind", KINDS)
def test_a_slider_moves_a_setting_of_the_drive(kind: str) -> None:
    drive = drive_classes()[kind]
    for slider in drive.sliders:
        assert slider.setting in drive.model_fields
        low, high, step = slider.limits
        assert low < high and 0.0 < step < high - low
        assert slider.unit and slider.letter
