from __future__ import annotations

import copy
import os
import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flexgui.core.arm.segment import Segment
from flexgui.core.effects import catalogue
from flexgui.core.errors import InputError
from flexgui.core.scenario.data_folder import VARIABLE, outside, resolve_file
from flexgui.core.scenario.read import (
    check_scenario,
    parse_scenario,
    read_scenario,
    scenario_toml,
    write_scenario,
)
from flexgui.core.scenario.schema import Scenario
from flexgui.core.sentences import did_you_mean
from tests.helpers import refusal
from tests.slips import changed, sentences_for

FULL = """
title = "Everything at once"
[arm]
preset = "paper"
modes = [2, 2]
EI = [500.0, 600.0]
gravity = [0.0, -9.81]
[drive]
kind = "torque"
torque_constant = [8.9, 0.87]
[model]
level = "nonlinear"
effects = [{id = "coulomb_friction", fc1 = {start = 1.0, vary = true}}]
[[model.own]]
target = "torque1"
formula = "-a*dtheta1**3"
parameters = {a = 1.0}
[sensors]
camera_noise = 3e-5
camera_rate = 100
[[recordings]]
file = "bench/th1.csv.gz"
window = [0.0, 5.0]
time_shift = 0.01
columns = {theta1 = "q1 [deg]", u1 = {name = "tau", gain = 2.0, sign = -1}}
mask = {deflection1 = [[0.0, 1.8], [2.0, 3.0]]}
logger_filter = {deflection1 = {frequency = 12.57, damping = 0.9}}
camera = {origin = [0.1, 0.2], angle = 0.1, scale = 1.1, delay = 0.01}
[[recordings]]
role = "validate"
simulate = {theta2 = 0.3927, snr_db = 20, hidden = {coulomb_friction = {fc1 = 1.0}}}
[[recordings]]
simulate = {sweep = [0.4, 2.7], excitation = "chirp", options = {f1 = 10.0}}
[identify]
method = "local"
parameters = ["EI1", "EI2"]
output = "z"
filter = {cutoff_hz = 25.0}
bounds = {EI1 = [400.0, 700.0]}
prior = {EI1 = 50.0, EI2 = {value = 520.0, std = 10.0}}
start = {EI1 = 500.0}
weights = {z1 = 2.0}
offsets = ["deflection1"]
generations = 0
[diagnose]
max_effects = 3
[[compare]]
title = "rigid"
arm = {modes = 0}
drop_logger_filters = true
"""


@pytest.fixture
def full() -> Scenario:
    return parse_scenario(FULL, "full.toml")


def test_full_scenario_is_understood(full):
    assert full.drive.options == {"torque_constant": [8.9, 0.87]}
    assert full.identify.output == ("z",)
    assert full.identify.prior["EI1"].std == 50.0
    assert full.recordings[0].columns["theta1"].name == "q1 [deg]"
    assert full.recordings[1].hidden == {"coulomb_friction": {"fc1": 1.0}}
    assert full.arm.overrides == {"modes": [2, 2], "EI": [500.0, 600.0]}


def test_recordings_without_a_name_get_one(full):
    assert [r.name for r in full.recordings] == ["th1", "simulated-1", "simulated-2"]
    twice = {"title": "x", "arm": {"preset": "paper"}, "recordings": [{"file": "a/th.csv"}] * 2}
    assert [r.name for r in check_scenario(twice, "x").recordings] == ["th", "th-2"]


@pytest.mark.parametrize("text", [FULL, 'title = "small"\n[arm]\npreset = "paper"\n'])
def test_a_written_scenario_is_read_back_equal(tmp_path, text):
    scenario = parse_scenario(text, "first.toml")
    write_scenario(scenario, tmp_path / "again.toml")
    assert read_scenario(tmp_path / "again.toml") == scenario
    assert scenario_toml(scenario) == scenario_toml(read_scenario(tmp_path / "again.toml"))
    assert [path.name for path in tmp_path.iterdir()] == ["again.toml"]


@settings(max_examples=50, deadline=None)
@given(st.text(max_size=20), st.lists(st.text(min_size=1, max_size=8), max_size=3, unique=True))
def test_any_words_survive_writing(title, parameters):
    document = {
        "title": title or "x",
        "arm": {"preset": "paper"},
        "identify": {"parameters": parameters},
        "drive": {"kind": "own", "note": title, "overrides": [1, "[", "a,\n"]},
    }
    scenario = check_scenario(document, "x.toml")
    assert parse_scenario(scenario_toml(scenario), "x.toml") == scenario


def _refusal(text: str) -> str:
    sentence = refusal(lambda: parse_scenario(text, "case.toml"))
    assert sentence.startswith("case.toml")
    return sentence


def test_each_fault_is_named_with_its_key():
    sentences_for("faults.txt", lambda entry: _refusal(changed(FULL, entry)))


@pytest.mark.parametrize("kind", sorted(catalogue()))
def test_a_slip_in_a_name_is_met_with_the_name(kind):
    for k in range(len(kind)):
        assert f"{kind!r}?" in did_you_mean(kind[:k] + kind[k + 1 :], catalogue())


@pytest.mark.parametrize(
    ("name", "known"),
    [
        ("u1", ("z1", "z2", "theta1", "y1")),
        ("densty", Segment.model_fields),
        ("friction", ("backlash", "tip_payload")),
    ],
)
def test_another_name_is_no_slip(name, known):
    assert did_you_mean(name, known).startswith("known: ")


def test_wrong_toml_is_named_with_its_line():
    assert "line 3" in _refusal('title = "x"\n[arm]\npreset = \n')


@pytest.mark.parametrize("text", ["", "title = 3", "arm = 3\ntitle = 'x'", "x = " + "[" * 5000])
def test_a_document_that_is_no_scenario_is_refused(text):
    _refusal(text)


SLOW = {
    "a long key": ".".join("a" * 100_000) + " = 1",
    "a long header": f"[{'.'.join('a' * 500)}]\n" + "\n".join(f"b{k} = 1" for k in range(5000)),
    "a long list": f"{FULL.partition('[identify]')[0]}[identify]\nparameters = {['a'] * 80_000}",
    "behind a text with four quotes": 'x = [ """a"""", ' + "1, " * 80_000 + '"""b"""" ]',
    "many tables": "[[recordings]]\n" * 33_000,
    "tables in tables": "x = " + "{a = " * 60 + "1" + "}" * 60,
}
"""Up to 480,000 characters that Python's reader or the checks took from a second to hours for."""


@pytest.mark.parametrize("text", SLOW.values(), ids=SLOW)
def test_a_document_that_takes_long_to_read_is_refused_unread(
    text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tomllib, "loads", None)
    with pytest.raises(
        InputError, match=r"nested too deeply or is too long|more than 50,000 values"
    ):
        parse_scenario(text, "x.toml")


def test_texts_and_comments_may_hold_any_number_of_signs() -> None:
    signs = ". , = [ { " * 5000
    text = f"""title = "{signs}\\\""
# {signs}'
[arm]  # "{signs}
preset = 'paper'"""
    assert parse_scenario(text, "x.toml").title.startswith(". , = [")


def test_missing_and_unreadable_files_are_told(tmp_path):
    (tmp_path / "latin.toml").write_bytes(b"title = '\xe9'")
    (tmp_path / "folder.toml").mkdir()
    for name in ("gone.toml", "latin.toml", "folder.toml"):
        with pytest.raises(InputError, match=name):
            read_scenario(tmp_path / name)


def _places(node: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Where something stands in a document, tables and lists included."""
    if isinstance(node, dict):
        inner = [p for k, v in node.items() for p in _places(v, (*path, k))]
    elif isinstance(node, list):
        inner = [p for k, v in enumerate(node) for p in _places(v, (*path, k))]
    else:
        inner = []
    return [path, *inner] if path else inner


DOCUMENT = tomllib.loads(FULL)
PLACES = _places(DOCUMENT)
VALUES = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=5)
    | st.lists(st.integers(-1, 1), max_size=4)
    | st.dictionaries(st.text(max_size=4), st.integers(), max_size=2)
)


def refused_in_a_sentence_at_worst(place, change) -> None:
    """`change` of a table or list and the key of what stands there."""
    document = copy.deepcopy(DOCUMENT)
    node: Any = document
    for part in place[:-1]:
        node = node[part]
    change(node, place[-1])
    try:
        check_scenario(document, "case.toml")
    except InputError as error:
        assert str(error).startswith("case.toml: ")
        assert "\n" not in str(error)
        assert str(place[0]) in str(error) or place[0] not in document


@settings(max_examples=400, deadline=None)
@given(st.sampled_from(PLACES), VALUES)
def test_any_value_anywhere_ends_in_a_sentence_at_worst(place, value):
    refused_in_a_sentence_at_worst(place, lambda node, key: node.__setitem__(key, value))


@settings(max_examples=100, deadline=None)
@given(st.sampled_from([p for p in PLACES if isinstance(p[-1], str)]), st.text("abz_", min_size=1))
def test_any_key_anywhere_ends_in_a_sentence_at_worst(place, key):
    refused_in_a_sentence_at_worst(place, lambda node, old: node.update({key: node.pop(old)}))


def test_files_are_looked_for_beside_the_scenario_and_then_in_the_data_folder(
    tmp_path, monkeypatch
):
    beside, data, other = tmp_path / "here", tmp_path / "data", tmp_path / "other"
    for folder in (beside, data, other):
        folder.mkdir()
    (data / "a.csv").touch()
    (other / "a.csv").touch()
    monkeypatch.setenv(VARIABLE, str(data))
    assert resolve_file("a.csv", beside) == data / "a.csv"
    assert resolve_file("a.csv", beside, other) == other / "a.csv"
    (beside / "a.csv").touch()
    assert resolve_file("a.csv", beside) == beside / "a.csv"


def test_a_file_that_is_nowhere_is_told_with_the_places(tmp_path, monkeypatch):
    monkeypatch.delenv(VARIABLE, raising=False)
    with pytest.raises(InputError, match=rf"gone\.csv.*{VARIABLE}") as caught:
        resolve_file("gone.csv", tmp_path)
    assert str(tmp_path) in str(caught.value)


def recorded(*files: str) -> Scenario:
    arm, entries = {"preset": "paper"}, [{"file": file} for file in files]
    return Scenario.model_validate({"title": "x", "arm": arm, "recordings": entries})


def test_files_outside_the_scenarios_and_the_data_folder_are_told(tmp_path, monkeypatch):
    monkeypatch.delenv(VARIABLE, raising=False)
    here, data = tmp_path / "here", tmp_path / "data"
    for folder in (here, data):
        folder.mkdir()
    for path in (here / "a.csv", data / "b.csv", tmp_path / "c.csv", tmp_path / "d.csv"):
        path.touch()
    (here / "link.csv").symlink_to(tmp_path / "d.csv")
    assert outside(recorded("a.csv", "b.csv"), here, data) == ""
    for file, target in (("../c.csv", "c.csv"), ("link.csv", "d.csv"), (f"{tmp_path}/c.csv",) * 2):
        assert str(tmp_path / target) in outside(recorded("a.csv", file), here, data)


def test_pipes_and_devices_are_refused_before_they_are_opened(tmp_path):
    pipe = tmp_path / "pipe.csv"
    os.mkfifo(pipe)
    for file in ("pipe.csv", "/dev/zero", "/dev/null"):
        with pytest.raises(InputError, match="device or a pipe"):
            resolve_file(file, tmp_path)
    for path in (pipe, Path("/dev/zero")):
        with pytest.raises(InputError, match="device or a pipe"):
            read_scenario(path)
