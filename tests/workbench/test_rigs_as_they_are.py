"""Rigs as laboratories have them: simulated with hidden friction and a delay, fitted from a plain
scenario, and the numbers are right."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flexgui.core.drives import build_drive
from flexgui.core.effects import effect
from flexgui.core.errors import InputError
from flexgui.core.progress import Silent
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.save import save_recording
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.results import NOTHING, Outcome
from flexgui.core.scenario.schema import DiagnoseSpec, Scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.core.simulate.experiment import NO_NOISE, make_task, read_sensors
from flexgui.core.simulate.nonlinear import simulate_within
from flexgui.core.workbench import load_recordings, run_scenario
from flexgui.sentences.identifiability import notes
from flexgui.sentences.ranked import in_order, tie
from flexgui.stages.diagnose.model_versions import ModelFindings
from flexgui.stages.diagnose.panel_candidates import may_explain
from flexgui.views.ranking import ranking_table
from tests.diagnose.fits import diagnosis_of

CLOSE = 0.01
"""Of the true value: five seconds with encoders of 10 µrad tell more than that; the servo's
response and straight lines between samples leave some thousandths."""

DELAY = 0.1e-3
"""s, a tenth of a sample."""

Table = dict[str, Any]

FILE = {"file": "rig.csv"}
NOISES = {"encoder_noise": 1e-5, "deflection_noise": 1e-4}
LATE_GAUGE = (
    {"id": "coulomb_friction", "fc1": 0.01},
    {"id": "sensor_delay", "tg1": {"start": 1e-3}},
)


def rig(
    arm: Table,
    drive: Table,
    recording: Table = FILE,
    effects: Sequence[Table] = (),
    sensors: Table = NOISES,
    diagnose: Table | None = None,
    **identify: Any,
) -> Scenario:
    """The rig's full equations, fitted to its file by descents alone."""
    return Scenario.model_validate({
        "title": "x",
        "arm": arm,
        "drive": drive,
        "model": {"level": "nonlinear", "effects": effects},
        "sensors": sensors,
        "identify": {"generations": 0, **identify},
        "recordings": [{"name": "rig", **recording}],
        **({} if diagnose is None else {"diagnose": diagnose}),
    })  # fmt: skip


def simulated(made: Scenario) -> Recording:
    """The recording of a scenario that simulates one."""
    (recording,) = load_recordings(made, base_model(made), Path(), None, Silent())
    return recording


def estimates(outcome: Outcome) -> dict[str, float]:
    return {e.name: e.value for fit in outcome.fits for e in fit.estimates}


def keep(recording: Recording, folder: Path, *channels: str, **further: np.ndarray) -> None:
    """The recording's file with no channels but those that the rig has."""
    kept = {name: recording[name] for name in channels}
    save_recording(replace(recording, channels={**kept, **further}), folder / "rig.csv")


def rotary(EI: float, kt: float = 7.68e-3, **more: Any) -> Scenario:
    """A flexible link of a motor on voltage."""
    link = {"length": 0.42, "mass": 0.065, "modes": 2, "hub_inertia": 2e-3, "damping_time": 0.01}
    motor = {"torque_constants": [kt], "resistances": [2.6], "gears": [70.0]}
    return rig({"segments": [{**link, "EI": EI}]}, {"kind": "voltage", **motor}, **more)


@pytest.fixture(scope="module")
def rotary_rig(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("rotary")
    hidden = {"coulomb_friction": {"fc1": 0.03}, "sensor_delay": {"tg1": 4e-3}}
    moved = {"seconds": 5.0, "amplitude": 2.0, "hold": 0.4, "seed": 3}
    made = simulated(rotary(0.15, recording={"simulate": moved, "hidden": hidden}))
    keep(made, folder, "voltage1", "theta1", "deflection1")
    return folder


def test_a_rotary_link_on_voltage_is_right(rotary_rig: Path) -> None:
    """The motor's own braking is four times the friction's slope and no part of it."""
    plain = rotary(0.2, effects=LATE_GAUGE, parameters=["EI1"])
    found = run_scenario(plain, folder=rotary_rig)
    assert found.notes[0].startswith("Compared output: torque (motor torque), deflection")
    values = estimates(found)
    assert values["EI1"] == pytest.approx(0.15, rel=CLOSE)
    assert values["fc1"] == pytest.approx(0.03, rel=CLOSE)
    assert values["tg1"] == pytest.approx(4e-3, abs=DELAY)


@pytest.mark.long
def test_a_torque_constant_is_estimated_beside_the_stiffness(rotary_rig: Path) -> None:
    """The link's mass is known, so the torque is; back-EMF and friction follow."""
    plain = rotary(0.2, 6.9e-3, effects=LATE_GAUGE, parameters=["EI1", "kt1"])
    values = estimates(run_scenario(plain, folder=rotary_rig))
    assert values["kt1"] == pytest.approx(7.68e-3, rel=CLOSE)
    assert values["EI1"] == pytest.approx(0.15, rel=CLOSE)


def two_encoders(Jh: float, c: float, **more: Any) -> Scenario:
    """A joint with encoders on both sides."""
    arm = {
        "length": 0.4, "mass": 1.5, "EI": 60.0, "modes": 1, "damping_time": 0.02,
        "segments": [{"hub_inertia": Jh, "joint_compliance": c}],
    }  # fmt: skip
    noises = {"encoder_noise": 1e-5, "link_encoder_noise": 1e-5}
    return rig(arm, {"kind": "torque"}, sensors=noises, filter={"cutoff_hz": 60.0}, **more)


def test_a_joint_with_motor_and_link_encoders_is_right(tmp_path: Path) -> None:
    moved = {"seconds": 4.0, "amplitude": 3.0, "hold": 0.15, "seed": 5}
    hidden = {"coulomb_friction": {"fc1": 0.4}, "sensor_delay": {"tl1": 3e-3}}
    true = two_encoders(0.05, 2e-3, recording={"simulate": moved, "hidden": hidden})
    keep(simulated(true), tmp_path, "u1", "theta1", "link_theta1")
    late = (LATE_GAUGE[0], {"id": "sensor_delay", "tl1": {"start": 1e-3}})
    found = run_scenario(
        two_encoders(0.08, 1e-3, effects=late, parameters=["c1", "Jh1"]), folder=tmp_path
    )
    assert "link_encoder" in found.notes[0]
    values = estimates(found)
    assert values["c1"] == pytest.approx(2e-3, rel=CLOSE)
    assert values["Jh1"] == pytest.approx(0.05, rel=CLOSE)
    assert values["fc1"] == pytest.approx(0.4, rel=CLOSE)
    assert values["tl1"] == pytest.approx(3e-3, abs=DELAY)


PULSE, EVERY, LASTS = 60.0, 1.0, 0.1
"""N, s and s: as large as the force of the loop, so that a model without them would be wrong."""


def true_slide(**recording: Any) -> Scenario:
    loop = {"kind": "velocity_loop", "gains": [900.0]}
    return rig({"preset": "single_axis", "mass": 95.0}, loop, recording, sensors={})


@pytest.fixture(scope="module")
def slide_rig(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A slide in its velocity loop, pushed by a second motor whose force is known."""
    folder = tmp_path_factory.mktemp("slide")
    bare = base_model(true_slide(simulate={"seconds": 6.0}))
    drive = build_drive("velocity_loop", {"gains": [900.0], "known_torque": [1]})
    model = replace(bare, drive=drive)
    model = model.with_effects([effect("coulomb_friction")], {"fc1": 20.0})
    spec = SimulateSpec(seconds=6.0, amplitude=0.15, hold=0.3, seed=2)
    task, _ = make_task(model, spec, "rig")
    pulses = np.where(task.time % EVERY < LASTS, PULSE, 0.0)
    task.references[:, 1] = pulses
    motion = simulate_within(model, model.numbers(), task).trajectory
    channels = read_sensors(model, motion, spec, NO_NOISE)
    made = Recording("rig", task.time, channels)
    keep(made, folder, "theta1", u1=channels["u1"] - pulses, known_torque1=pulses)
    return folder


def slide(known: Sequence[int] = (), **identify: Any) -> Scenario:
    """Driven by its torque, too light, with a weak friction."""
    return rig(
        {"preset": "single_axis", "mass": 80.0}, {"kind": "torque", "known_torque": known},
        effects=[{"id": "coulomb_friction", "fc1": 5.0}], sensors={}, parameters=["m1"],
        filter={"cutoff_hz": 40.0}, **identify,
    )  # fmt: skip


def test_a_slide_with_known_pulses_is_right(slide_rig: Path) -> None:
    values = estimates(run_scenario(slide([1]), folder=slide_rig))
    assert values["m1"] == pytest.approx(95.0, rel=CLOSE)
    assert values["fc1"] == pytest.approx(20.0, rel=2.0 * CLOSE)
    without = estimates(run_scenario(slide(), folder=slide_rig))
    assert abs(without["m1"] / 95.0 - 1.0) > 3.0 * CLOSE


def test_a_scale_that_the_mass_imitates_is_said_to_and_stands_last(slide_rig: Path) -> None:
    """Half the encoder's scale and twice the mass make the same force."""
    asked = DiagnoseSpec(max_effects=0, candidates=["sensor_gain", "torque_offset"])
    wanting = slide().model_copy(update={"diagnose": asked})
    found = diagnosis_of(wanting, folder=slide_rig)
    *_, last = in_order(found.ranking[::-1])
    assert last.effect == "sensor_gain" and [e.name for e in last.tied_to] == ["m1"]
    assert tie(last).startswith("cannot be distinguished from m1, which would change from 91.4")
    seen = replace(last, refit_drop_percent=1.0)
    assert "cannot be distinguished from m1" in ranking_table((seen,)).rows[0].cells[5]
    looked = ModelFindings(found.steps[0], (), (), (), (), (last,), diagnosis=found)
    assert not may_explain(looked) and may_explain(replace(looked, ranking=found.ranking[:1]))


SERVO = {"kind": "cascade", "position_gains": [15.0, 15.0], "velocity_gains": [8.0, 0.4]}
BENCH = {"preset": "two_stage_bench"}


@pytest.fixture(scope="module")
def bench_rig(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bench whose servo holds the joints."""
    folder = tmp_path_factory.mktemp("bench")
    moved = {"seconds": 4.0, "amplitude": 0.3, "hold": 0.3, "seed": 4, "theta": [0.0, 0.0]}
    late = {"tg1": 5e-3, "tg2": 5e-3}
    hidden = {"coulomb_friction": {"fc1": 0.6, "fc2": 0.1}, "sensor_delay": late}
    made = simulated(rig(BENCH, SERVO, {"simulate": moved, "hidden": hidden}))
    keep(made, folder, "theta1", "theta2", "deflection1", "deflection2")
    return folder


def held(**more: Any) -> Scenario:
    """With both stiffnesses to be found."""
    start = {"EI1": 3.5, "EI2": 0.36}
    return rig(BENCH, {"kind": "held"}, parameters=list(start), start=start, **more)


def held_late(**identify: Any) -> Scenario:
    late = {"id": "sensor_delay", "tg1": {"start": 1e-3}, "tg2": {"start": 1e-3}}
    return held(effects=[late], **identify)


@pytest.mark.long
def test_a_bench_held_by_its_servo_is_right(bench_rig: Path) -> None:
    """No torque is known, and none is compared: the joints' friction moves nothing."""
    found = run_scenario(held_late(), folder=bench_rig)
    assert "torque" not in found.notes[0]
    values = estimates(found)
    truth = {e.name: e.value for e in base_model(held()).arm_catalogue.parameters.values()}
    for name in ("EI1", "EI2"):
        assert values[name] == pytest.approx(truth[name], rel=CLOSE)
    for name in ("tg1", "tg2"):
        assert values[name] == pytest.approx(5e-3, abs=DELAY)
    assert {c.channel for c in found.comparisons[0].channels} == {"deflection1", "deflection2"}


UNKNOWN: Table = {"sensors": {}, "diagnose": {"max_effects": 3}}
"""Of a scenario that says nothing of the sensors, up to three effects."""


@pytest.mark.long
def test_what_a_rig_on_voltage_lacks_is_named(rotary_rig: Path) -> None:
    """The delay comes first; friction must not give way to what leaves more of the error."""
    found = diagnosis_of(rotary(0.2, parameters=["EI1"], **UNKNOWN), folder=rotary_rig)
    assert set(found.steps[-1].model) == {"sensor_delay", "coulomb_friction"}
    assert found.final_verdict == NOTHING
    assert found.values["fc1"] == pytest.approx(0.03, rel=CLOSE)
    assert found.values["tg1"] - found.values["te1"] == pytest.approx(4e-3, abs=DELAY)


@pytest.mark.long
def test_what_a_held_rig_lacks_is_named_without_a_torque(bench_rig: Path) -> None:
    found = diagnosis_of(held(**UNKNOWN), folder=bench_rig)
    assert found.steps[-1].model == ("sensor_delay",)
    assert found.final_verdict == NOTHING
    for k in "12":
        late = found.values[f"tg{k}"] - found.values[f"te{k}"]
        assert late == pytest.approx(5e-3, abs=DELAY)


def test_a_held_rig_is_not_simulated_without_a_recording() -> None:
    with pytest.raises(InputError, match="needs recorded joints"):
        simulated(held(recording={"simulate": {"theta": [0.0, 0.0]}}))


@pytest.mark.parametrize("output", ["torque", "encoder"])
def test_what_a_held_rig_cannot_be_compared_in_is_refused(bench_rig: Path, output: str) -> None:
    with pytest.raises(InputError, match="knows no torque"):
        run_scenario(held_late(output=output), folder=bench_rig)


def test_a_run_with_another_friction_is_named(tmp_path: Path) -> None:
    """The slide four times on the same references; in the third run the guide is stiffer."""
    names = ("first", "second", "third", "fourth")
    moved = {"seconds": 3.0, "amplitude": 0.15, "hold": 0.3, "seed": 2}
    for seed, name in enumerate(names):
        friction = {"coulomb_friction": {"fc1": 24.0 if name == "third" else 20.0}}
        made = simulated(true_slide(simulate=moved, hidden=friction))
        noise = 2e-6 * np.random.default_rng(seed).standard_normal(len(made.time))
        kept = {n: made[n] for n in ("u1", "dtheta1_ref")}
        channels = {**kept, "theta1": made["theta1"] + noise}
        save_recording(replace(made, channels=channels), tmp_path / f"{name}.csv")
    document = slide(method="local").model_dump(exclude_unset=True)
    document["recordings"] = [{"file": f"{name}.csv"} for name in names]
    said = notes(run_scenario(Scenario.model_validate(document), folder=tmp_path))
    accused = [note for note in said if note.startswith("Run ")]
    assert len(accused) == 1 and accused[0].startswith("Run third differs in fc1 by +20 %")
    assert any(note.startswith("m1: standard deviation") for note in said)
