"""Challenges: the same seed the same bytes, a model without the effect, the truth under a seal."""

from __future__ import annotations

import json
import re
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from typer.testing import CliRunner

from flexgui.cli import app
from flexgui.core.challenge.challenge import (
    HEAD,
    SCENARIO,
    TRUTH_FILE,
    make_challenge,
    obfuscate,
    reveal,
    write_challenge,
)
from flexgui.core.effects import catalogue
from flexgui.core.errors import InputError
from flexgui.core.loading import load_recordings
from flexgui.core.progress import Silent
from flexgui.core.scenario.read import read_scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.stages.challenge.judging import truth_of, truth_text


@pytest.fixture(scope="module")
def made() -> Any:
    return make_challenge(3, "hard")


@pytest.fixture(scope="module")
def folder(made: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("challenge")
    write_challenge(made, out)
    return out


def _bytes(folder: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in folder.iterdir()}


def test_the_same_seed_gives_the_same_bytes(folder: Path, tmp_path: Path) -> None:
    write_challenge(make_challenge(3, "hard"), tmp_path / "again")
    assert _bytes(tmp_path / "again") == _bytes(folder)


def test_the_files_are_a_scenario_with_seven_points_and_a_sweep(folder: Path) -> None:
    scenario = read_scenario(folder / SCENARIO)
    recordings = load_recordings(scenario, base_model(scenario), folder, None, Silent())
    assert [r.role for r in recordings] == ["estimate"] * 7 + ["validate"]
    points = [r.theta2 for r in recordings if r.theta2 is not None]
    assert points == pytest.approx([k * np.pi / 8 for k in range(1, 8)])
    sweep = recordings[-1]["theta2"]
    assert sweep.max() - sweep.min() > 2.0


def test_the_model_has_no_effect_and_no_file_names_one(folder: Path) -> None:
    assert not base_model(read_scenario(folder / SCENARIO)).effects
    text = "".join(p.read_text() for p in folder.iterdir() if p.suffix != ".csv")
    assert not [kind for kind in catalogue() if kind in text]


@pytest.mark.parametrize(("level", "count"), [("easy", 1), ("hard", 2)])
def test_as_many_effects_are_hidden_as_the_level_says(level: str, count: int) -> None:
    from flexgui.core.challenge.challenge import _kinds
    from flexgui.core.challenge.hidden_effect import prerequisites

    for seed in range(30):
        kinds = _kinds(count, np.random.default_rng(seed))
        parts = [e.kind for kind in kinds for e in prerequisites(catalogue()[kind])]
        assert len({*kinds, *parts}) == count


@pytest.mark.parametrize(
    "seed", [4, pytest.param(1, marks=pytest.mark.long), pytest.param(8, marks=pytest.mark.long)]
)
def test_each_hidden_effect_is_well_above_the_noise(seed: int) -> None:
    """Of these seeds one effect or both were hidden below 1.4 times the noise."""
    obfuscated = make_challenge(seed, "hard").obfuscated
    shown = json.loads(reveal(obfuscated, TRUTH_FILE))["shown"]
    assert len(shown) == 2 and min(shown.values()) >= 1.9
    assert not re.search(r" = 0 ", truth_text(reveal(obfuscated, TRUTH_FILE)))


def test_reveal_says_what_and_how_large(folder: Path) -> None:
    said = truth_of(folder)
    named = [kind for kind in catalogue() if f"({kind})" in said]
    assert len(named) == 2
    assert "times the noise" in said and "EI = " in said
    assert said == truth_of(folder / TRUTH_FILE)


def test_a_zip_holds_the_same_files(folder: Path, made: Any, tmp_path: Path) -> None:
    for name in ("a.zip", "b.zip"):
        write_challenge(made, tmp_path / name)
    assert (tmp_path / "a.zip").read_bytes() == (tmp_path / "b.zip").read_bytes()
    with zipfile.ZipFile(tmp_path / "a.zip") as archive:
        assert {n: archive.read(n) for n in archive.namelist()} == _bytes(folder)
    assert truth_of(tmp_path / "a.zip") == truth_of(folder)


@pytest.mark.parametrize(
    "arguments",
    [
        ["challenge", "--seed", "1", "--level", "esy", "--out", "x"],
        ["challenge", "--seed", "-1", "--out", "x"],
        ["reveal", "nowhere"],
        ["reveal", "."],
        ["reveal", "x.zip"],
    ],
)
def test_bad_input_is_one_sentence_and_two(
    arguments: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("x.zip").write_bytes(b"no zip")
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 2
    assert result.output.startswith("flexgui: ") and result.output.count("\n") == 1


TEXT = '{"effects": ["coulomb_friction"], "values": {"fc1": 0.2}}'


@example("x" * 5000, "salt")
@given(st.text(max_size=200).map(str.rstrip), st.text(max_size=20))
def test_what_is_sealed_comes_out_whatever_the_line_ends(text: str, salt: str) -> None:
    sealed = obfuscate(text, salt)
    assert sealed == obfuscate(text, salt)
    assert reveal(sealed, "x") == reveal(sealed.replace("\n", "\r\n"), "x") == text


def test_nothing_can_be_read_and_neither_length_nor_salt_tell_anything() -> None:
    sealed, other = obfuscate(TEXT, "1"), obfuscate(TEXT, "2")
    assert "coulomb" not in sealed and len(obfuscate("nothing", "1")) == len(sealed)
    assert not set(sealed.splitlines()[1:]) & set(other.splitlines()[1:])


@pytest.mark.parametrize("place", [0, 10, 300, -3])
def test_a_changed_character_breaks_the_seal(place: int) -> None:
    head, _, body = obfuscate(TEXT, "1").partition("\n")
    at = place % len(body)
    other = "A" if body[at] != "A" else "B"
    with pytest.raises(InputError, match="truth.sealed: the file was changed"):
        reveal(f"{head}\n{body[:at]}{other}{body[at + 1 :]}", "truth.sealed")


@pytest.mark.parametrize(
    "text", ["", HEAD, HEAD + "\n", HEAD + "\nAAAA\n", HEAD + "\n%%%\n", "{}", HEAD + "\nä\n"]
)
def test_what_is_no_seal_is_called_broken(text: str) -> None:
    with pytest.raises(InputError, match="broken"):
        reveal(text, "x")
