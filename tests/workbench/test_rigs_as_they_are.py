"""Rigs as laboratories have them: simulated with hidden friction and a delay, fitted from a plain
scenario, and the numbers are right."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flexgui.core.drives import build_drive
from flexgui.core.effects import effect
from flexgui.core.errors import InputError
from flexgui.core.progress import Silent
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.save import save_recording
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.results import NOTHING, Diagnosis, Outcome
from flexgui.core.scenario.read import parse_scenario
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

FILE = 'file = "rig.csv"'


def estimates(outcome: Outcome) -> dict[str, float]:
    return {e.name: e.value for fit in outcome.fits for e in fit.estimates}


def simulated(text: str) -> Recording:
    """The recording of a scenario that simulates one."""
    made = scenario(text)
    (recording,) = load_recordings(made, base_model(made), Path(), None, Silent())
    return recording


def scenario(text: str) -> Scenario:
    return parse_scenario(text, "rig.toml")


def keep(recording: Recording, folder: Path, *channels: str, **further: np.ndarray) -> None:
    """The recording's file with no channels but those that the rig has."""
    kept = {name: recording[name] for name in channels}
    save_recording(replace(recording, channels={**kept, **further}), folder / "rig.csv")


ROTARY = """
title = "Rotary flexible link on voltage"
[arm]
segments = [
  {{ length = 0.42, mass = 0.065, EI = {EI}, modes = 2, hub_inertia = 2e-3, damping_time = 0.01 }},
]
[drive]
kind = "voltage"
torque_constants = [{kt}]
resistances = [2.6]
gears = [70.0]
[model]
level = "nonlinear"
effects = [{effects}]
[sensors]
encoder_noise = 1e-5
deflection_noise = 1e-4
[identify]
parameters = [{parameters}]
generations = 0
[[recordings]]
name = "rig"
{recording}
"""
ROTARY_RECORDING = """
simulate = { seconds = 5.0, amplitude = 2.0, hold = 0.4, seed = 3 }
hidden = { coulomb_friction = { fc1 = 0.03 }, sensor_delay = { tg1 = 4e-3 } }
"""
LATE_GAUGE = (
    '{ id = "coulomb_friction", fc1 = 0.01 }, { id = "sensor_delay", tg1 = { start = 1e-3 } }'
)


def rotary(recording: str, EI: float, kt: float, effects: str, parameters: str) -> str:
    return ROTARY.format(recording=recording, EI=EI, kt=kt, effects=effects, parameters=parameters)


@pytest.fixture(scope="module")
def rotary_rig(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("rotary")
    made = simulated(rotary(ROTARY_RECORDING, 0.15, 7.68e-3, "", ""))
    keep(made, folder, "voltage1", "theta1", "deflection1")
    return folder


def test_a_rotary_link_on_voltage_is_right(rotary_rig: Path) -> None:
    """The motor's own braking is four times the friction's slope and no part of it."""
    plain = scenario(rotary(FILE, 0.2, 7.68e-3, LATE_GAUGE, '"EI1"'))
    found = run_scenario(plain, folder=rotary_rig)
    assert found.notes[0].startswith("Compared output: torque (motor torque), deflection")
    values = estimates(found)
    assert values["EI1"] == pytest.approx(0.15, rel=CLOSE)
    assert values["fc1"] == pytest.approx(0.03, rel=CLOSE)
    assert values["tg1"] == pytest.approx(4e-3, abs=DELAY)


def test_a_torque_constant_is_estimated_beside_the_stiffness(rotary_rig: Path) -> None:
    """The link's mass is known, so the torque is; back-EMF and friction follow."""
    plain = scenario(rotary(FILE, 0.2, 6.9e-3, LATE_GAUGE, '"EI1", "kt1"'))
    values = estimates(run_scenario(plain, folder=rotary_rig))
    assert values["kt1"] == pytest.approx(7.68e-3, rel=CLOSE)
    assert values["EI1"] == pytest.approx(0.15, rel=CLOSE)


TWO_ENCODERS = """
title = "A joint with encoders on both sides"
[arm]
length = 0.4
mass = 1.5
EI = 60.0
modes = 1
damping_time = 0.02
segments = [{{ hub_inertia = {Jh}, joint_compliance = {c} }}]
[drive]
kind = "torque"
[model]
level = "nonlinear"
effects = [{effects}]
[sensors]
encoder_noise = 1e-5
link_encoder_noise = 1e-5
[identify]
parameters = [{parameters}]
filter = {{ cutoff_hz = 60.0 }}
generations = 0
[[recordings]]
name = "rig"
{recording}
"""
TWO_RECORDING = """
simulate = { seconds = 4.0, amplitude = 3.0, hold = 0.15, seed = 5 }
hidden = { coulomb_friction = { fc1 = 0.4 }, sensor_delay = { tl1 = 3e-3 } }
"""


def test_a_joint_with_motor_and_link_encoders_is_right(tmp_path: Path) -> None:
    text = TWO_ENCODERS.format(Jh=0.05, c=2e-3, effects="", parameters="", recording=TWO_RECORDING)
    keep(simulated(text), tmp_path, "u1", "theta1", "link_theta1")
    effects = LATE_GAUGE.replace("tg1", "tl1")
    names = '"c1", "Jh1"'
    text = TWO_ENCODERS.format(Jh=0.08, c=1e-3, effects=effects, parameters=names, recording=FILE)
    found = run_scenario(scenario(text), folder=tmp_path)
    assert "link_encoder" in found.notes[0]
    values = estimates(found)
    assert values["c1"] == pytest.approx(2e-3, rel=CLOSE)
    assert values["Jh1"] == pytest.approx(0.05, rel=CLOSE)
    assert values["fc1"] == pytest.approx(0.4, rel=CLOSE)
    assert values["tl1"] == pytest.approx(3e-3, abs=DELAY)


SLIDE = """
title = "A slide with known pulses"
[arm]
preset = "single_axis"
mass = {mass}
[drive]
{drive}
[model]
level = "nonlinear"
effects = [{effects}]
[identify]
parameters = [{parameters}]
filter = {{ cutoff_hz = 40.0 }}
generations = 0
[[recordings]]
name = "rig"
{recording}
"""
PULSE, EVERY, LASTS = 60.0, 1.0, 0.1
"""N, s and s: as large as the force of the loop, so that a model without them would be wrong."""


def true_slide(recording: str) -> str:
    loop = 'kind = "velocity_loop"\ngains = [900.0]'
    return SLIDE.format(mass=95.0, drive=loop, effects="", parameters="", recording=recording)


@pytest.fixture(scope="module")
def slide_rig(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A slide in its velocity loop, pushed by a second motor whose force is known."""
    folder = tmp_path_factory.mktemp("slide")
    bare = base_model(scenario(true_slide("simulate = { seconds = 6.0 }")))
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


def stated_slide(recording: str, known: str = "") -> str:
    """Driven by its torque, too light, with a weak friction."""
    return SLIDE.format(
        mass=80.0, drive=f'kind = "torque"{known}', parameters='"m1"', recording=recording,
        effects='{ id = "coulomb_friction", fc1 = 5.0 }',
    )  # fmt: skip


def slide(known: bool) -> Scenario:
    return scenario(stated_slide(FILE, "\nknown_torque = [1]" if known else ""))


def test_a_slide_with_known_pulses_is_right(slide_rig: Path) -> None:
    values = estimates(run_scenario(slide(known=True), folder=slide_rig))
    assert values["m1"] == pytest.approx(95.0, rel=CLOSE)
    assert values["fc1"] == pytest.approx(20.0, rel=2.0 * CLOSE)
    without = estimates(run_scenario(slide(known=False), folder=slide_rig))
    assert abs(without["m1"] / 95.0 - 1.0) > 3.0 * CLOSE


def test_a_scale_that_the_mass_imitates_is_said_to_and_stands_last(slide_rig: Path) -> None:
    """Half the encoder's scale and twice the mass make the same force."""
    asked = DiagnoseSpec(max_effects=0, candidates=["sensor_gain", "torque_offset"])
    wanting = slide(known=False).model_copy(update={"diagnose": asked})
    found = diagnosis_of(wanting, folder=slide_rig)
    *_, last = in_order(found.ranking[::-1])
    assert last.effect == "sensor_gain" and [e.name for e in last.tied_to] == ["m1"]
    assert tie(last).startswith("cannot be distinguished from m1, which would change from 91.4")
    seen = replace(last, refit_drop_percent=1.0)
    assert "cannot be distinguished from m1" in ranking_table((seen,)).rows[0].cells[5]
    looked = ModelFindings(found.steps[0], (), (), (), (), (last,), diagnosis=found)
    assert not may_explain(looked) and may_explain(replace(looked, ranking=found.ranking[:1]))


BENCH = """
title = "A bench whose servo holds the joints"
[arm]
preset = "two_stage_bench"
[drive]
{drive}
[model]
level = "nonlinear"
effects = [{effects}]
[sensors]
encoder_noise = 1e-5
deflection_noise = 1e-4
[identify]
parameters = [{parameters}]
start = {{ {start} }}
generations = 0
[[recordings]]
name = "rig"
{recording}
"""
SERVO = 'kind = "cascade"\nposition_gains = [15.0, 15.0]\nvelocity_gains = [8.0, 0.4]'
BENCH_RECORDING = """
simulate = { seconds = 4.0, amplitude = 0.3, hold = 0.3, seed = 4, theta = [0.0, 0.0] }
hidden = { coulomb_friction = { fc1 = 0.6, fc2 = 0.1 }, sensor_delay = { tg1 = 5e-3, tg2 = 5e-3 } }
"""
HELD = 'kind = "held"'


@pytest.fixture(scope="module")
def bench_rig(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bench")
    text = BENCH.format(drive=SERVO, effects="", parameters="", start="", recording=BENCH_RECORDING)
    keep(simulated(text), folder, "theta1", "theta2", "deflection1", "deflection2")
    return folder


def held_text(effects: str = "") -> str:
    """With both stiffnesses to be found."""
    return BENCH.format(
        drive=HELD, effects=effects, parameters='"EI1", "EI2"', start="EI1 = 3.5, EI2 = 0.36",
        recording=FILE,
    )  # fmt: skip


def held() -> Scenario:
    late = '{ id = "sensor_delay", tg1 = { start = 1e-3 }, tg2 = { start = 1e-3 } }'
    return scenario(held_text(late))


def test_a_bench_held_by_its_servo_is_right(bench_rig: Path) -> None:
    """No torque is known, and none is compared: the joints' friction moves nothing."""
    found = run_scenario(held(), folder=bench_rig)
    assert "torque" not in found.notes[0]
    values = estimates(found)
    truth = {e.name: e.value for e in base_model(held()).arm_catalogue.parameters.values()}
    for name in ("EI1", "EI2"):
        assert values[name] == pytest.approx(truth[name], rel=CLOSE)
    for name in ("tg1", "tg2"):
        assert values[name] == pytest.approx(5e-3, abs=DELAY)
    assert {c.channel for c in found.comparisons[0].channels} == {"deflection1", "deflection2"}


NOISES = "[sensors]\nencoder_noise = 1e-5\ndeflection_noise = 1e-4\n"


def diagnosed(text: str, folder: Path) -> Diagnosis:
    """Of a scenario that says nothing of the sensors, up to three effects."""
    plain = text.replace(NOISES, "").replace("[[rec", "[diagnose]\nmax_effects = 3\n[[rec")
    return diagnosis_of(scenario(plain), folder=folder)


@pytest.mark.long
def test_what_a_rig_on_voltage_lacks_is_named(rotary_rig: Path) -> None:
    """The delay comes first; friction must not give way to what leaves more of the error."""
    found = diagnosed(rotary(FILE, 0.2, 7.68e-3, "", '"EI1"'), rotary_rig)
    assert set(found.steps[-1].model) == {"sensor_delay", "coulomb_friction"}
    assert found.final_verdict == NOTHING
    assert found.values["fc1"] == pytest.approx(0.03, rel=CLOSE)
    assert found.values["tg1"] - found.values["te1"] == pytest.approx(4e-3, abs=DELAY)


@pytest.mark.long
def test_what_a_held_rig_lacks_is_named_without_a_torque(bench_rig: Path) -> None:
    found = diagnosed(held_text(), bench_rig)
    assert found.steps[-1].model == ("sensor_delay",)
    assert found.final_verdict == NOTHING
    for k in "12":
        late = found.values[f"tg{k}"] - found.values[f"te{k}"]
        assert late == pytest.approx(5e-3, abs=DELAY)


def test_a_held_rig_is_not_simulated_without_a_recording() -> None:
    text = BENCH.format(drive=HELD, effects="", parameters="", start="", recording=BENCH_RECORDING)
    with pytest.raises(InputError, match="needs recorded joints"):
        simulated(text)


@pytest.mark.parametrize("output", ["torque", "encoder"])
def test_what_a_held_rig_cannot_be_compared_in_is_refused(bench_rig: Path, output: str) -> None:
    spec = held()
    asked = spec.model_copy(update={"identify": spec.identify.model_copy(
        update={"output": (output,)})})  # fmt: skip
    with pytest.raises(InputError, match="knows no torque"):
        run_scenario(asked, folder=bench_rig)


def test_a_run_with_another_friction_is_named(tmp_path: Path) -> None:
    """The slide four times on the same references; in the third run the guide is stiffer."""
    names = ("first", "second", "third", "fourth")
    for seed, name in enumerate(names):
        friction = 24.0 if name == "third" else 20.0
        made = simulated(true_slide(REPEATED.format(friction=friction)))
        noise = 2e-6 * np.random.default_rng(seed).standard_normal(len(made.time))
        kept = {n: made[n] for n in ("u1", "dtheta1_ref")}
        channels = {**kept, "theta1": made["theta1"] + noise}
        save_recording(replace(made, channels=channels), tmp_path / f"{name}.csv")
    files = "\n[[recordings]]\n".join(f'file = "{name}.csv"' for name in names)
    text = (
        stated_slide(files)
        .replace('name = "rig"\n', "")
        .replace("[identify]", '[identify]\nmethod = "local"')
    )
    said = notes(run_scenario(scenario(text), folder=tmp_path))
    accused = [note for note in said if note.startswith("Run ")]
    assert len(accused) == 1 and accused[0].startswith("Run third differs in fc1 by +20 %")
    assert any(note.startswith("m1: standard deviation") for note in said)


REPEATED = """
simulate = {{ seconds = 3.0, amplitude = 0.15, hold = 0.3, seed = 2 }}
hidden = {{ coulomb_friction = {{ fc1 = {friction} }} }}
"""
