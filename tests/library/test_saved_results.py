"""What was found lasts: saved, opened in another process, exported again, pickled."""

from __future__ import annotations

import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import flexgui as fg
from tests.library.rigs import LOOP, QUICK

EXPORT_AGAIN = """
import sys
import flexgui as fg

fg.open(sys.argv[1]).export(sys.argv[2])
"""


def rig(**more: object) -> fg.Project:
    """A project whose recordings came as tables, of an arm with a friction that it lacks."""
    machine = fg.project("paper", LOOP)
    friction = {"coulomb_friction": {"fc1": 1.2, "fc2": 0.5}}
    tables = [
        machine.simulate(theta2=p, seconds=0.3, seed=k, hidden=friction).to_dataframe()
        for k, p in enumerate((0.8, 1.7), start=1)
    ]
    return fg.project("paper", LOOP, tables, title="Rig", identify=QUICK, **more)


@pytest.fixture(scope="module")
def identified() -> fg.Identification:
    return rig().identify()


@pytest.fixture(scope="module")
def diagnosed() -> fg.Diagnosis:
    return rig(diagnose={"candidates": ["coulomb_friction", "viscous_friction"]}).diagnose()


def content(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


@pytest.mark.long
@pytest.mark.parametrize("command", [False, True])
def test_opened_in_another_process_it_exports_the_same_files(
    command: bool, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    found = request.getfixturevalue("identified" if command else "diagnosed")
    found.export(tmp_path / "first")
    found.save(tmp_path / "saved")
    asked = ["-m", "flexgui", "export", "first", "--out", "again"]
    asked = asked if command else ["-c", EXPORT_AGAIN, "saved", "again"]
    subprocess.run([sys.executable, *asked], check=True, cwd=tmp_path)
    first, again = content(tmp_path / "first"), content(tmp_path / "again")
    assert set(first) == set(again)
    assert [name for name in first if first[name] != again[name]] == []


def test_opened_it_is_what_it_was(identified: fg.Identification, tmp_path: Path) -> None:
    opened = fg.open(identified.save(tmp_path / "saved"))
    assert isinstance(opened, fg.Identification)
    assert opened.parameters == identified.parameters
    assert repr(opened) == repr(identified)
    assert opened.compare().to_dataframe().equals(identified.compare().to_dataframe())
    assert opened.covariance().equals(identified.covariance())
    assert (
        opened.simulate(theta2=1.0, seconds=0.1)
        .to_dataframe()
        .equals(identified.simulate(theta2=1.0, seconds=0.1).to_dataframe())
    )


def test_an_export_can_be_opened_too_and_moved(
    identified: fg.Identification, tmp_path: Path
) -> None:
    identified.export(tmp_path / "report")
    shutil.move(tmp_path / "report", tmp_path / "elsewhere")
    opened = fg.open(tmp_path / "elsewhere")
    assert opened.values == identified.values
    path = identified.given.save(tmp_path / "rig" / "rig.toml")
    path.write_text("# by hand\n" + path.read_text("utf-8"), "utf-8")
    project = fg.load(path)
    assert project.to_toml().startswith("# by hand"), "the words of who wrote it are kept"
    assert not project.with_settings(title="other").to_toml().startswith("# by hand")
    for ours, theirs in zip(opened.given.recordings(), identified.given.recordings(), strict=True):
        assert np.array_equal(ours["z1"], theirs["z1"])


def test_the_project_with_what_was_found_begins_where_the_fit_ended(
    identified: fg.Identification,
) -> None:
    again = identified.project().identify()
    for name, value in identified.values.items():
        assert again[name].start == value
        assert again[name].value == pytest.approx(value, abs=identified[name].std)


def test_the_project_of_a_diagnosis_lacks_nothing(diagnosed: fg.Diagnosis) -> None:
    assert diagnosed.added == ("coulomb_friction",)
    grown = diagnosed.project()
    assert [e.id for e in grown.scenario.model.effects] == ["coulomb_friction"]
    assert grown.model.effect_values["fc1"] == diagnosed.values["fc1"]


@pytest.mark.parametrize("of", ["identified", "diagnosed"])
def test_a_result_with_tables_is_pickled(of: str, request: pytest.FixtureRequest) -> None:
    found = request.getfixturevalue(of)
    copy = pickle.loads(pickle.dumps(found))
    assert copy.values == found.values
    for ours, theirs in zip(copy.given.recordings(), found.given.recordings(), strict=True):
        assert np.array_equal(ours["z1"], theirs["z1"])


def test_what_lacks_a_result_a_table_or_the_end_of_a_file_is_named(
    identified: fg.Identification, tmp_path: Path
) -> None:
    with pytest.raises(fg.InputError, match=r"holds no saved result \(result\.flexgui"):
        fg.open(tmp_path)
    (identified.save(tmp_path) / "2.parquet").unlink()
    with pytest.raises(fg.InputError, match=r"lacks 2\.parquet, which belongs to the result"):
        fg.open(tmp_path)
    file = identified.save(tmp_path / "other") / "result.flexgui"
    file.write_bytes(file.read_bytes()[:-100])
    with pytest.raises(fg.InputError, match="cannot be opened: it is damaged"):
        fg.open(tmp_path / "other")
