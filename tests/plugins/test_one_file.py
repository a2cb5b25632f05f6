"""A new effect, sensor, drive or view is one file, and nothing else changes.

Each file is written into a temporary folder that becomes part of the package's path, which is what
a file in the package's own folder would be.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import MagicMock

import numpy as np
import plotly.graph_objects as go
import pytest

import flexgui as fg
from flexgui.core.plugins import look_again
from flexgui.core.recording import channels as known_channels
from flexgui.core.recording.load import load_recording
from flexgui.core.recording.spec import RecordingSpec
from flexgui.core.scenario.schema import DiagnoseSpec
from flexgui.reference import reference_text
from flexgui.stages.challenge.panel import GuessFields
from flexgui.stages.compare import panel as compare_panel
from flexgui.views.names import channel_title

EI = 520.8333
"""N m², of the paper's arm."""
SIGMAS = 5.0
"""Standard deviations that an estimate may miss the truth by."""
RECOVERED = 0.01
"""Share by which a size may miss the truth without noise; the fit's own tolerance is a tenth."""
QUICK = {"parameters": ["EI1", "EI2"], "output": ["z", "encoder"], "generations": 0}

Add = Callable[[str, str, str], Any]


@pytest.fixture
def add(tmp_path: Path) -> Iterator[Add]:
    """Write a file into a folder of a package; it is gone after the test."""
    added: list[tuple[str, str]] = []
    before = dict(known_channels._OF_SENSORS)

    def put(package: str, name: str, text: str) -> Any:
        (tmp_path / f"{name}.py").write_text(text, encoding="utf-8")
        path = cast(list[str], importlib.import_module(package).__path__)
        path.append(str(tmp_path))
        added.append((package, name))
        look_again()
        return importlib.import_module(f"{package}.{name}")

    yield put
    for package, name in added:
        cast(list[str], importlib.import_module(package).__path__).remove(str(tmp_path))
        sys.modules.pop(f"{package}.{name}", None)
        with suppress(AttributeError):
            delattr(importlib.import_module(package), name)
    known_channels._OF_SENSORS.clear()
    known_channels._OF_SENSORS.update(before)
    known_channels._by_name.cache_clear()
    look_again()


def machine(**tables: Any) -> fg.Project:
    return fg.project(
        "paper", fg.drives.VelocityLoop(gains=(60.0, 30.0)), model={"level": "nonlinear"}, **tables
    )


EFFECT = '''
"""A spring that somebody left at the joints."""

import sympy as sp

from flexgui.core.effects.effect import Effect
from flexgui.core.effects.per_joint import each_joint, joint_elements
from flexgui.core.forces.law import V, X, joint_law

_K = sp.Symbol("k", nonnegative=True)
LAW = joint_law(-_K * X, (_K,))


class ReturnSpring(Effect):
    """-k theta at every joint."""

    kind = "return_spring"
    location = "joint"
    title = "Return spring"
    story = "A spring pulls a joint back. The missing torque is a line over the joint's place."
    formula = r"\\tau = -k \\theta"
    acts_at = "joints"

    def parameters(self, arm, drive, sizes):
        return each_joint(arm, "ks", "return spring {}", lambda j: "N m/rad", 1.0)

    def elements(self, arm, p, values):
        return joint_elements(arm, LAW, ("ks",), values)
'''


def test_an_effect_is_one_file(add: Add, tmp_path: Path) -> None:
    add("flexgui.core.effects", "return_spring", EFFECT)
    hidden = {"return_spring": {"ks1": 0.0, "ks2": 4.0}}
    made = machine().simulate(theta2=1.2, seconds=0.5, hidden=hidden)
    rig = machine(recordings=[made.recording], identify=QUICK)
    found = rig.with_effects("return_spring").identify()
    assert found["ks2"].value == pytest.approx(4.0, rel=RECOVERED)
    asked = rig.with_settings(diagnose={"candidates": ["return_spring", "viscous_friction"]})
    diagnosed = asked.diagnose(max_effects=1)
    assert diagnosed.added == ("return_spring",)
    assert "return_spring" in reference_text()
    report = diagnosed.export(tmp_path / "report").read_text(encoding="utf-8")
    assert "Return spring" in report and "return spring 2" in report
    assert "Return spring" in offered_effects()


def offered_effects() -> tuple[str, ...]:
    """What the page's fields for a guess let a person choose."""
    gui = MagicMock()
    GuessFields(cast(Any, SimpleNamespace(gui=gui, read_only=True)), "Effect", "nothing")
    return tuple(gui.add_dropdown.call_args_list[0].args[1])


LOOSE = r'''
"""A mass that hangs on a spring at the tip: a coordinate of its own, beside the beams."""

import numpy as np
import sympy as sp

from flexgui.core.effects.effect import Effect, EffectParameter
from flexgui.core.effects.per_joint import sized
from flexgui.core.forces.element import Element
from flexgui.core.forces.law import ForceLaw

_M, _W, _B = sp.symbols("m w b", nonnegative=True)
_X = sp.symbols("x1 x2 y1 y2", real=True)
_V = sp.symbols("v1 v2 u1 u2", real=True)
_D, _S = sp.symbols("d1 d2", real=True), sp.symbols("s1 s2", real=True)
_PULL = [_W**2 * d + _B * (s - v) for d, s, v in zip(_D, _S, _V)]
LAW = ForceLaw(
    _X, _V, (*(_M * a for a in _PULL), *[sp.Integer(0)] * 2), (_M, _W, _B), (*_D, *_S),
    (_S[0] - _V[0], _S[1] - _V[1], -_PULL[0], -_PULL[1]),
)


class LooseMass(Effect):
    """Its displacement d from the tip and its velocity s are the law's states."""

    kind = "loose_mass"
    location = "segments"
    title = "Loose mass at the tip"
    story = "What the tip carries hangs on a spring, and swings after each move."
    formula = r"F = m (\omega^2 d + b \dot d), \quad m \ddot z_m = -F"
    acts_at = "tip"

    def parameters(self, arm, drive, sizes):
        shaped = sized("wl", 50.0, "rad/s", "angular frequency of the loose mass")
        return (
            sized("ml", 0.2, "kg", "loose mass"),
            EffectParameter(shaped.parameter, 50.0, secondary=True),
            EffectParameter(sized("bl", 5.0, "1/s", "its damping").parameter, 5.0,
                            secondary=True),
        )

    def elements(self, arm, p, values):
        nowhere = np.zeros(arm.coordinates)
        numbers = tuple(values[name] for name in ("ml", "wl", "bl"))
        return (Element(LAW, (nowhere, nowhere), numbers, at_tip=True),)
'''
STIFF = 0.02
"""Share of what a mass at the tip does by which one on a spring of 200 Hz differs from it."""


def test_an_effect_with_a_coordinate_of_its_own_is_one_file(add: Add) -> None:
    add("flexgui.core.effects", "loose_mass", LOOSE)
    settings = {"theta2": 1.2, "seconds": 0.5}
    hidden = {"loose_mass": {"ml": 0.5, "wl": 40.0, "bl": 2.0}}
    made = machine().simulate(**settings, hidden=hidden)
    rig = machine(recordings=[made.recording], identify=QUICK)
    found = rig.with_effects("loose_mass").identify()
    for name, value in hidden["loose_mass"].items():
        assert found[name].value == pytest.approx(value, rel=RECOVERED)
    asked = rig.with_settings(diagnose={"candidates": ["loose_mass", "viscous_friction"]})
    assert asked.diagnose(max_effects=1).added == ("loose_mass",)

    def tip(**effects: dict[str, float]) -> np.ndarray:
        return np.asarray(machine().simulate(**settings, hidden=effects).recording["z2"])

    held, tied = (
        tip(tip_payload={"mt2": 0.5}),
        tip(loose_mass={"ml": 0.5, "wl": 1260.0, "bl": 120.0}),
    )
    assert np.std(tied - held) < STIFF * np.std(tip() - held)


SENSOR = '''
"""An accelerometer at the tip."""

import numpy as np

from flexgui.core.recording.channels import ChannelKind
from flexgui.core.sensors.sensor import Channel, Sensor


class TipAccelerometer(Sensor):
    """Acceleration of the end effector in the plane."""

    kind = "acceleration"
    title = "tip accelerometer"
    noise = "accelerometer_noise"
    primary = True
    columns = (ChannelKind("a#", "12", ("m/s²",), "tip acceleration", sparse=True),)

    def defined_on(self, arm):
        return arm.joints > 1

    def channels(self, arm):
        return Channel("a1", "m/s²"), Channel("a2", "m/s²")

    def measure(self, trajectory):
        speed = trajectory.tip()[1]
        return np.gradient(speed, trajectory.time[1] - trajectory.time[0], axis=0)
'''
NOISE = 0.02
"""m/s², of the accelerometer in these tests."""


def test_a_sensor_is_one_file_and_the_noise_of_the_others_stays(add: Add, tmp_path: Path) -> None:
    noisy = {"camera_noise": 3e-5, "encoder_noise": 1e-5}
    before = machine(sensors=noisy).simulate(theta2=1.2, seconds=0.5, seed=7).recording
    add("flexgui.core.sensors", "tip_accelerometer", SENSOR)
    rig = machine(sensors={**noisy, "accelerometer_noise": NOISE})
    after = rig.simulate(theta2=1.2, seconds=0.5, seed=7).recording
    for name, values in before.channels.items():
        assert np.array_equal(values, after.channels[name]), name
    quiet = rig.simulate(theta2=1.2, seconds=0.5, seed=7, noise=False).recording
    assert np.std(after["a1"] - quiet["a1"]) == pytest.approx(NOISE, rel=0.1)

    path = tmp_path / "run.csv"
    rig.simulate(theta2=1.2, seconds=0.5, seed=7).to_dataframe().to_csv(path, index=False)
    read = load_recording(path, RecordingSpec(file="run.csv"))
    assert read["a2"] == pytest.approx(after["a2"], rel=1e-12)


def test_a_new_sensor_is_identified_from_and_its_noise_is_known(add: Add) -> None:
    add("flexgui.core.sensors", "tip_accelerometer", SENSOR)
    single = fg.project("single_axis", "torque", model={"level": "nonlinear"})
    assert "a1" not in single.simulate(seconds=0.1).recording.channels, "where its class says"
    assert channel_title("a1") == "tip acceleration a1"
    with pytest.raises(fg.InputError, match="'accelerometer_noise'"):
        machine(sensors={"acelerometer_noise": 0.1})
    stated = {"accelerometer_noise": NOISE, "encoder_noise": 1e-5}
    made = machine(sensors=stated).simulate(theta2=1.2, seconds=0.5, seed=7)
    outputs = {**QUICK, "output": ["acceleration", "encoder"]}
    rig = machine(recordings=[made.recording], sensors=stated, identify=outputs)
    found = rig.identify()
    assert abs(found["EI1"].value - EI) < SIGMAS * found["EI1"].std
    assert "a1" in {c.channel for c in found.compare().recordings[0].channels if c.fitted}
    step = rig.with_settings(diagnose={"candidates": ["viscous_friction"]}).diagnose().steps[0]
    floors = {e.channel: e for e in step.errors}
    assert floors["a1"].floor_source == "stated"
    left = DiagnoseSpec().fidelity * np.std(made.recording["a1"])
    assert floors["a1"].floor == pytest.approx(np.hypot(NOISE, left), rel=0.02)
    assert rig.with_settings().scenario.sensors.noise_of("accelerometer_noise") == NOISE
    assert "accelerometer_noise" in rig.to_toml()
    assert "`accelerometer_noise`" in reference_text()


def test_a_sensor_is_delayed_with_the_camera_only_where_it_says_so(
    add: Add, tmp_path: Path
) -> None:
    """Whatever its name begins with: yaw is neither of the camera's y and z."""
    named = SENSOR.replace("acceleration", "yaw").replace("a#", "yaw#")
    named = named.replace('"a1"', '"yaw1"').replace('"a2"', '"yaw2"')
    add("flexgui.core.sensors", "yaw_rate", named)
    path = tmp_path / "run.csv"
    made = machine().simulate(theta2=1.2, seconds=0.5, seed=7, noise=False)
    made.to_dataframe().to_csv(path, index=False)
    late = [{"file": str(path), "theta2": 1.2, "camera": {"delay": 0.02}}]
    outputs = {"output": ["yaw", "z"]}
    compared = machine(recordings=late, identify=outputs).compare().recordings[0].channels
    fit = {c.channel: c.fit_percent for c in compared}
    assert fit["yaw1"] > 99.0 > 90.0 > fit["z1"]


@pytest.mark.long
def test_a_new_sensor_has_a_delay_of_its_own(add: Add) -> None:
    """Neither the camera's nor another sensor's; it is called what the sensor is."""
    add("flexgui.core.sensors", "tip_accelerometer", SENSOR)
    late = {"sensor_delay": {"tacceleration1": 0.004, "tacceleration2": 0.004}}
    made = machine().simulate(theta2=1.2, seconds=0.5, seed=7, hidden=late)
    outputs = {"parameters": ["EI1"], "output": ["acceleration", "z", "encoder"], "generations": 0}
    rig = machine(recordings=[made.recording], identify=outputs).with_effects("sensor_delay")
    found = rig.identify()
    for name in ("tacceleration1", "tacceleration2"):
        assert found[name].value == pytest.approx(0.004, rel=RECOVERED)
    assert abs(found["te1"].value) < 1e-5
    assert rig.model.parameter("tacceleration2").title == "delay of tip accelerometer 2"


DRIVE = '''
"""A loop on the joint's place with damping."""

from typing import ClassVar

import numpy as np

from flexgui.core.drives.drive import Drive, DriveSlider, gain_parameter, per_joint, stated_or
from flexgui.core.drives.law import static_law
from flexgui.core.validation import Positive


class Damped(Drive):
    """u = k (theta* - theta) - b theta', b in N m s/rad."""

    kind: ClassVar[str] = "damped"
    sliders = (DriveSlider("stiffness", "k", "N m/rad", (0.0, 5000.0, 10.0), "Place gain."),)

    stiffness: tuple[Positive, ...]
    damping: tuple[Positive, ...]

    def check(self, arm):
        per_joint(self.stiffness, arm, "stiffness")
        per_joint(self.damping, arm, "damping")

    def parameters(self, arm):
        return tuple(
            gain_parameter(f"b{k + 1}", b, "N m s/rad", f"b_{k + 1}", f"damping {k + 1}")
            for k, b in enumerate(self.damping)
        )

    def reference_channels(self, arm):
        return tuple(f"theta{k + 1}_ref" for k in range(arm.joints))

    def law(self, arm, p, values):
        P, V = np.zeros((arm.joints, arm.coordinates)), np.zeros((arm.joints, arm.coordinates))
        P[:, : arm.joints] = np.diag(self.stiffness)
        V[:, : arm.joints] = np.diag(stated_or("b", self.damping, values))
        return static_law(np.diag(self.stiffness), P, V)
'''


def test_a_drive_is_one_file(add: Add) -> None:
    add("flexgui.core.drives", "damped", DRIVE)
    true = {"kind": "damped", "stiffness": [900.0, 400.0], "damping": [60.0, 30.0]}
    settings = {"theta2": 1.2, "seconds": 0.5, "amplitude": 0.02}
    made = fg.project("paper", true, model={"level": "nonlinear"}).simulate(**settings)
    wrong = {**true, "damping": [50.0, 30.0]}
    rig = fg.project(
        "paper", wrong, [made.recording], model={"level": "nonlinear"},
        identify={**QUICK, "parameters": ["b1", "EI1"]},
    )  # fmt: skip
    assert rig.identify()["b1"].value == pytest.approx(60.0, rel=RECOVERED)
    assert rig.linear(theta2=1.2).inputs == ("theta1_ref", "theta2_ref")
    assert "`damped`" in reference_text()


SERVED = '''
"""Recorded torques along joints that a servo of damping ratio 0.7 leads."""

from dataclasses import dataclass

import numpy as np
import scipy

from flexgui.core.drives.servo import FollowingServo
from flexgui.core.drives.torque import Torque

RATIO = 0.7


@dataclass(frozen=True)
class LightServo(FollowingServo):
    """J (w^2 e + 2 RATIO w e')."""

    def gains(self):
        place, speed = super().gains()
        return place, RATIO * speed

    def response(self, x, dt, hz=None):
        w = 2.0 * np.pi * (hz or self.hz)
        system = [2.0 * RATIO * w, w * w], [1.0, 2.0 * RATIO * w, w * w]
        b, a, _ = scipy.signal.cont2discrete(system, dt, method="foh")
        b, a = np.ravel(b), np.ravel(a)
        steady = np.outer(scipy.signal.lfilter_zi(b, a), x[0])
        return scipy.signal.lfilter(b, a, x, axis=0, zi=steady)[0]


class LightlyServed(Torque):
    """Torque, with another servo."""

    kind = "lightly_served"

    @property
    def servo(self):
        return LightServo
'''


def test_a_drive_with_another_servo_is_one_file(add: Add, monkeypatch: pytest.MonkeyPatch) -> None:
    module = add("flexgui.core.drives", "lightly_served", SERVED)
    asked: list[Any] = []
    answer = module.LightServo.response

    def response(self: Any, *signal: Any) -> Any:
        asked.append(self.base)
        return answer(self, *signal)

    monkeypatch.setattr(module.LightServo, "response", response)
    made = machine().simulate(theta2=1.2, seconds=0.5)
    kept = {name: made.recording[name] for name in ("u1", "u2", "theta1", "theta2", "z1", "z2")}
    recording = replace(made.recording, channels=kept)
    rig = fg.project(
        "paper", "lightly_served", [recording], model={"level": "nonlinear"},
        identify={**QUICK, "output": ["torque", "z"]},
    )  # fmt: skip
    found = rig.identify()
    assert found["EI2"].value == pytest.approx(EI, rel=RECOVERED)
    assert asked and {drive.kind for drive in asked} == {"lightly_served"}
    assert [t.joint for t in found.compare().recordings[0].missing_torque] == [1, 2]


VIEW = '''
"""How the errors are distributed."""

import plotly.graph_objects as go

from flexgui.views.of_recording.view import RecordingView, Seen


class ErrorHistogram(RecordingView):
    """A histogram per fitted output."""

    kind = "error_histogram"
    title = "histogram of the error"
    in_report = True
    about = "White noise is a bell."

    def draw(self, seen: Seen) -> go.Figure | None:
        figure = go.Figure()
        for c in seen.current.channels:
            if c.fitted:
                figure.add_histogram(x=c.residual[c.counted], name=c.channel)
        return figure.update_layout(height=300)
'''


def test_a_view_is_one_file(add: Add, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    add("flexgui.views.of_recording", "error_histogram", VIEW)
    made = machine().simulate(theta2=1.2, seconds=0.3)
    compared = machine(recordings=[made.recording], identify=QUICK).compare()
    figure = compared.plot("error_histogram")
    assert isinstance(figure, go.Figure)
    assert [trace.name for trace in figure.data] == ["z1", "z2", "theta1", "theta2"]

    assert "| `error_histogram` | histogram of the error |" in reference_text()
    found = machine(recordings=[made.recording], identify=QUICK).identify()
    report = found.export(tmp_path / "report").read_text(encoding="utf-8")
    assert "Histogram of the error" in report and "White noise is a bell." in report

    offered = compare_panel.shown_titles()
    assert "histogram of the error" in offered
    assert offered[0] == compare_panel.SIGNALS
