"""`import flexgui as fg`: quick to import, built on the workbench, frozen results."""

from __future__ import annotations

import dataclasses
import inspect
import re
import subprocess
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import plotly.graph_objects as go
import pytest
from scipy.optimize import linear_sum_assignment

import flexgui as fg
from flexgui.core.arm.presets import presets
from flexgui.core.recording.save import save_recording
from flexgui.core.scenario.read import parse_scenario, read_scenario
from flexgui.core.workbench import run_scenario
from flexgui.export.folder import dumps
from flexgui.export.result import result as as_document
from tests.library.rigs import EI, LOOP, QUICK
from tests.library.rigs import rig as full

ROOT = Path(__file__).resolve().parents[2]
IMPORT_SECONDS = 0.3
"""CPU seconds of `import flexgui` alone; the wall clock would measure who else works here."""
DIGITS = 1e-9
"""Two ways to one number through the same code."""


@pytest.fixture(scope="module")
def rig() -> fg.Project:
    machine = full()
    made = machine.simulate(theta2=1.1, seconds=0.5, seed=4)
    check = machine.simulate(theta2=1.6, seconds=0.5, seed=5).to_dataframe()
    recordings = [made.recording, {"table": check, "role": "validate", "name": "check"}]
    return full(recordings, title="Quick", identify=QUICK)


UPDATES: list[fg.Update] = []


@pytest.fixture(scope="module")
def found(rig: fg.Project) -> fg.Identification:
    return rig.identify(UPDATES.append)


def test_importing_loads_nothing_and_is_quick() -> None:
    code = (
        "import sys, time; a = time.process_time(); before = set(sys.modules); import flexgui; "
        "spent = time.process_time() - a; heavy = {'numpy', 'numba', 'plotly', 'pandas', 'viser'}; "
        "assert not heavy & (set(sys.modules) - before); print(spent)"
    )
    told = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert float(told.stdout) < IMPORT_SECONDS


def test_every_public_name_is_there_and_explained() -> None:
    names = [n for n in dir(fg) if n[0] != "_" and n in fg._MODULES]
    assert len(names) > 25 and {"load", "project", "Segment"} <= set(names)
    assert not {"Any", "TYPE_CHECKING", "import_module", "annotations"} & set(dir(fg))
    for name in names:
        assert getattr(fg, name).__doc__, name
    with pytest.raises(AttributeError, match="identfy"):
        fg.identfy  # type: ignore[attr-defined]  # noqa: B018


def public_callables() -> Iterator[tuple[str, Any]]:
    """Functions and methods of the library that a user may call."""
    for name in fg._MODULES:
        thing = getattr(fg, name)
        if inspect.isfunction(thing) and thing.__module__.startswith("flexgui.library"):
            yield name, thing
        if inspect.isclass(thing) and thing.__module__.startswith("flexgui.library"):
            for key, method in vars(thing).items():
                if inspect.isfunction(method) and not key.startswith("_"):
                    yield f"{name}.{key}", method


@pytest.mark.parametrize(
    ("name", "called"), [*public_callables()], ids=lambda x: x if isinstance(x, str) else ""
)
def test_every_argument_and_result_is_explained(name: str, called: Any) -> None:
    text = called.__doc__
    assert text, name
    taken = [k for k in inspect.signature(called).parameters if k != "self"]
    args = text.partition("Args:")[2].partition("Returns:")[0]
    for argument in taken:
        assert re.search(rf"^\s+\*{{0,2}}{argument}: ", args, re.MULTILINE), f"{name}: {argument}"
    if "raise InputError" in inspect.getsource(called):
        assert "Raises:" in text, name


def run(*arguments: str) -> int:
    from flexgui.cli import run as run_command

    return run_command(arguments)


def test_scenarios_are_listed_with_their_titles_and_loaded_by_name(
    capsys: pytest.CaptureFixture[str],
) -> None:
    known = fg.scenarios()
    assert known["paper_glocal"] == "The paper: seven working points at once"
    assert "mujoco/nothing" in known and "mujoco/truth" not in known
    assert fg.load("paper_glocal").scenario == read_scenario(ROOT / "scenarios/paper_glocal.toml")
    with pytest.raises(fg.InputError, match="did you mean 'paper_glocal'"):
        fg.load("paper_glocl")
    assert run("scenarios") == 0
    assert "paper_glocal" in capsys.readouterr().out


def test_a_file_beside_wins_over_a_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("paper_glocal").write_text('title = "mine"\n[arm]\npreset = "paper"\n', encoding="utf-8")
    assert fg.load("paper_glocal").title == "mine"


@pytest.mark.parametrize("name", sorted(fg.scenarios()))
def test_changing_nothing_leaves_the_scenario_as_it_was(name: str) -> None:
    rig = fg.load(name)
    same = rig.with_settings()
    assert same.scenario == rig.scenario
    assert same.scenario.model_fields_set == rig.scenario.model_fields_set


@pytest.mark.long
def test_objects_and_a_file_give_the_same_numbers(
    rig: fg.Project, found: fg.Identification, tmp_path: Path
) -> None:
    path = rig.save(tmp_path / "rig.toml")
    outcome = run_scenario(read_scenario(path), folder=tmp_path)
    shared = [e for e in outcome.fits[0].estimates if e.recording is None]
    for ours, theirs in zip(found.parameters, shared, strict=True):
        assert ours.value == pytest.approx(theirs.value, rel=DIGITS)
    assert abs(found["EI1"].value - EI) < 5.0 * found["EI1"].std
    assert found.values["EI1"] == found["EI1"].value and not found.stopped


def test_results_are_frozen(rig: fg.Project, found: fg.Identification) -> None:
    for result in (rig, found, found.compare(), rig.linear(theta2=1.0)):
        with pytest.raises(dataclasses.FrozenInstanceError):
            result.outcome = None  # type: ignore[misc,union-attr]


def test_results_are_tables_figures_and_html(rig: fg.Project, found: fg.Identification) -> None:
    compared, linear = found.compare(), rig.linear(theta2=1.0)
    for result in (found, compared, linear):
        assert isinstance(result.to_dataframe(), pd.DataFrame)
        assert isinstance(result.plot(), go.Figure)
        assert "<table" in result._repr_html_()
    assert "<table" in rig._repr_html_()
    poles = linear.to_dataframe()
    assert np.isclose(poles["damped_hz"], linear.modes[0].frequency).any()
    assert (poles["natural_hz"] >= poles["damped_hz"]).all()
    assert isinstance(compared.plot("error_by_frequency", "check"), go.Figure)
    table = found.to_dataframe()
    assert {"EI1", "EI2"} == set(table["parameter"][table["recording"].isna()])


def test_a_result_prints_as_a_few_lines(rig: fg.Project, found: fg.Identification) -> None:
    for result in (found, found.compare(), rig.linear(theta2=1.0), rig):
        lines = repr(result).splitlines()
        assert len(lines) <= 5 and all(len(line) < 200 for line in lines), lines
        assert "array(" not in repr(result)
    assert any(line.startswith("EI₁ = ") for line in repr(found).splitlines())


@pytest.mark.parametrize(
    ("make", "names"),
    [
        (lambda: fg.drives.VelocityLoop(gains=60), "VelocityLoop gains is 60"),
        (lambda: fg.Segment(length=-1, mass=1, EI=1), "Segment length is -1"),
        (lambda: fg.Segment(lenth=1, mass=1), "did you mean 'length'"),
        (lambda: fg.Arm(segments=()), "Arm segments"),
    ],
)
def test_a_wrong_setting_of_an_object_is_one_sentence(make: Any, names: str) -> None:
    with pytest.raises(fg.InputError, match=names) as told:
        make()
    assert "\n" not in str(told.value) and "pydantic" not in str(told.value)


def test_a_view_that_is_not_known_is_met_with_the_nearest(found: fg.Identification) -> None:
    with pytest.raises(fg.InputError, match="correlation"):
        found.plot("corelation")
    with pytest.raises(fg.InputError, match="nothing to show"):
        found.plot("valley")


def test_a_comparison_at_stated_values_estimates_nothing(rig: fg.Project) -> None:
    near, far = rig.compare(), rig.compare({"EI1": 300.0})
    assert far["check"].tip_rms > 5.0 * near["check"].tip_rms
    with pytest.raises(fg.InputError, match="EI1"):
        rig.compare({"EI11": 300.0})


def as_read(found: fg.Identification | fg.Diagnosis) -> str:
    """All that a script reads of a result, without the time that it took."""
    return dumps({**as_document(found.outcome, ()), "seconds": None})


@pytest.mark.long
def test_one_processor_finds_the_same_as_all_and_tells_what_is_done(
    rig: fg.Project, found: fg.Identification
) -> None:
    check_counters(UPDATES)
    assert as_read(rig.identify(workers=1)) == as_read(found)
    with pytest.raises(fg.InputError, match="workers is 0"):
        rig.identify(workers=0)
    unchecked, words = rig.identify(check=False), "The recordings were not checked for faults."
    assert words in unchecked.outcome.notes and words not in found.outcome.notes


def lacking() -> fg.Project:
    """A rig with a friction that its model lacks."""
    hidden = {"coulomb_friction": {"fc1": 4.0}}
    made = fg.project("paper", LOOP).simulate(theta2=1.1, seconds=0.3, hidden=hidden)
    return fg.project("paper", LOOP, made, identify=QUICK)


def check_counters(updates: list[fg.Update]) -> None:
    """In each stage the total stays, and what is done rises from nothing to the total at most."""
    assert updates
    for before, now in pairwise(updates):
        assert 0 <= now.done <= (now.done if now.total is None else now.total), now
        if now.stage == before.stage:
            assert now.total == before.total, (before, now)
            assert now.done >= before.done and now.simulations >= before.simulations, (before, now)
        else:
            assert (now.done, now.simulations) == (0, 0), now


@pytest.mark.long
def test_a_diagnosis_on_one_processor_finds_the_same_as_on_two() -> None:
    seen: dict[int, list[fg.Update]] = {1: [], 2: []}
    alone, both = (lacking().diagnose(seen[n].append, workers=n) for n in seen)
    assert as_read(alone) == as_read(both)
    for updates in seen.values():
        check_counters(updates)
    ended = {u.stage: u for u in seen[1]}
    assert ended["Trying every known effect"].done == ended["Trying every known effect"].total
    assert ended["Fitting the most promising effects"].simulations > 0


def test_progress_is_told_and_false_stops(rig: fg.Project) -> None:
    seen: list[fg.Update] = []

    def stop_in_the_fit(update: fg.Update) -> bool:
        seen.append(update)
        return update.stage != "Identifying"

    with pytest.raises(fg.StoppedError) as stopped:
        rig.diagnose(stop_in_the_fit)
    assert {"Reading the recordings", "Identifying"} <= {u.stage for u in seen}
    assert "EI1" in stopped.value.identification.values


def test_a_diagnosis_that_was_stopped_says_so() -> None:
    stages: list[str] = []

    def stop_in_the_diagnosis(update: fg.Update) -> bool:
        stages.append(update.stage)
        compared = [k for k, stage in enumerate(stages) if stage.startswith("Comparing")]
        return not compared or set(stages[compared[-1] :]) == {stages[compared[-1]]}

    told = lacking().diagnose(stop_in_the_diagnosis)
    assert told.stopped and told.final_verdict is None
    assert "search was stopped" in told.words[0] and "search was stopped" in repr(told)


MADE_AS = {
    "a table": lambda made, folder: made.to_dataframe(),
    "a recording": lambda made, folder: made.recording,
    "a simulation": lambda made, folder: made,
    "a path": lambda made, folder: folder / "made.csv",
    "a relative path": lambda made, folder: "made.csv",
    "settings": lambda made, folder: {"file": "made.csv", "role": "validate"},
    "settings of a table": lambda made, folder: {"table": made.to_dataframe()},
}


@pytest.fixture(scope="module")
def made() -> fg.Simulation:
    return fg.project("paper", LOOP).simulate(theta2=1.1, seconds=0.2)


@pytest.mark.parametrize("form", MADE_AS.values(), ids=MADE_AS)
def test_one_recording_needs_no_list(form: Any, made: fg.Simulation, tmp_path: Path) -> None:
    made.to_dataframe().to_csv(tmp_path / "made.csv", index=False)
    (read,) = fg.project("paper", LOOP, form(made, tmp_path), folder=tmp_path).recordings()
    assert read["z1"] == pytest.approx(made.recording["z1"], abs=1e-12)


def test_tables_and_files_stand_side_by_side(made: fg.Simulation, tmp_path: Path) -> None:
    other = fg.project("paper", LOOP).simulate(theta2=1.1, seconds=0.2, seed=9)
    here, there = tmp_path / "here", tmp_path / "there"
    for place, name in ((here, "1.parquet"), (there, "far.csv")):
        place.mkdir()
        save_recording(other.recording, place / name)
    given = [made, "1.parquet", {"table": made.recording, "name": "again"}, {"file": "far.csv"}]
    rig = fg.project("paper", LOOP, given, folder=here, data=there)
    assert rig.save(tmp_path / "saved" / "rig.toml").is_file()
    for project in (rig, fg.load(tmp_path / "saved" / "rig.toml")):
        read = [each["z1"] for each in project.recordings()]
        for z, expected in zip(read, (made, other, made, other), strict=True):
            assert z == pytest.approx(expected.recording["z1"], abs=1e-12)
    with pytest.raises(fg.InputError, match="gone.csv was not found in .*here"):
        fg.project("paper", LOOP, [made, "gone.csv"], folder=here)


CLOCKS = {
    "durations": lambda t: pd.to_timedelta(t, unit="s"),
    "durations in microseconds": lambda t: pd.to_timedelta(t, unit="s").astype("m8[us]"),
    "dates": lambda t: pd.Timestamp("2026-05-01") + pd.to_timedelta(t, unit="s"),
}


@pytest.mark.parametrize("clock", CLOCKS.values(), ids=CLOCKS)
@pytest.mark.parametrize("place", ["index", "t", "t [s]", "t [ms]", "stamp"])
def test_durations_and_dates_are_a_clock_in_seconds(
    clock: Any, place: str, made: fg.Simulation
) -> None:
    table = made.to_dataframe().drop(columns="t [s]")
    given: dict[str, Any] = {"columns": {"t": "stamp"}} if place == "stamp" else {}
    times = pd.Index(clock(made.recording.time))
    given["table"] = table.set_index(times) if place == "index" else table.assign(**{place: times})
    (read,) = fg.project("paper", LOOP, given).recordings()
    assert read.time == pytest.approx(made.recording.time, abs=1e-9)


@pytest.mark.parametrize("name", ["paper", "single_axis", "two_stage_uncoupled"])
def test_an_arm_as_an_object_keeps_all_that_it_states(name: str) -> None:
    stated = presets()[name].model_copy(update={"base_compliance": 1e-5, "gravity": (0.0, -9.81)})
    made = fg.project(stated, fg.drives.VelocityLoop(gains=(60.0,) * stated.joints))
    assert made.model.arm == stated
    assert parse_scenario(made.to_toml(), "saved.toml").arm == made.scenario.arm


def test_effects_are_given_by_id_class_table_and_formula(rig: fg.Project) -> None:
    coulomb = fg.effects.CoulombFriction
    assert fg.effects["coulomb_friction"] is coulomb
    text = fg.formula("joint1", "-a*dtheta1", a={"start": 0.5, "unit": "N m s/rad"})
    grown = rig.with_effects("viscous_friction", coulomb, {"id": "backlash"}, text)
    assert [e.kind for e in grown.model.effects][-1] == "own_1"
    assert {"viscous_friction", "coulomb_friction", "backlash"} <= {
        e.kind for e in grown.model.effects
    }
    with pytest.raises(fg.InputError, match="viscous_friction"):
        rig.with_effects("viscus_friction")


def test_what_is_no_plug_in_is_not_registered() -> None:
    taken = type("Taken", (fg.Drive,), {"kind": "torque"})
    for kind, words in ((dict, "no subclass"), (taken, "torque")):
        with pytest.raises(fg.InputError, match=words):
            fg.register(kind)
    assert fg.drives["torque"] is not taken


def test_the_matrices_of_the_descriptor_form_have_the_frequency_response(rig: fg.Project) -> None:
    at, hz = rig.linear(theta2=1.0), 3.0
    gain = at.C @ np.linalg.solve(2j * np.pi * hz * at.E - at.A, at.B) + at.D
    assert gain == pytest.approx(at.frequency_response(np.array([hz])).gain[0], rel=1e-8)


def test_scipy_and_control_have_the_same_poles_as_the_model(rig: fg.Project) -> None:
    control = pytest.importorskip("control", reason="python-control is not installed")
    at = rig.linear(theta2=1.0)
    system = at.to_control()
    assert isinstance(system, control.StateSpace)
    assert system.input_labels == list(at.inputs)
    ours = at.frequency_response(np.array([3.0])).gain[0]
    assert system(2j * np.pi * 3.0) == pytest.approx(ours, rel=1e-8)
    state = at.to_scipy()
    size = np.abs(at.poles).max()
    apart = np.abs(np.linalg.eigvals(state.A)[:, None] - at.poles[None, :])
    places, ours_at = linear_sum_assignment(apart)  # nearly equal real parts have no order
    assert apart[places, ours_at].max() < 1e-8 * size
