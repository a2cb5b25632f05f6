"""The same experiment in every format: one line of TOML, the same arrays."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from flexgui.core.errors import InputError
from flexgui.core.recording import read_table as reading
from flexgui.core.recording.load import load_recording
from flexgui.core.recording.read_table import read_table
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.spec import RecordingSpec, SimulateSpec
from flexgui.core.scenario.data_folder import resolve_file
from flexgui.core.sentences import install_command
from flexgui.core.simulate.experiment import simulate_recording
from tests.helpers import PAPER, looped
from tests.recording.lab_formats import FORMATS

NAMES = ("dtheta1_ref", "dtheta2_ref", "theta1", "theta2", "z1", "z2")
EXACT = 1e-12
"""Of 1 rad or 1 m: fifteen digits of text, degrees there and back; estimates follow as closely."""
CLOCK = 1e-9
"""s: the nanoseconds of the clocks of ROS."""


@pytest.fixture(scope="module")
def experiment() -> Recording:
    spec = SimulateSpec(theta2=1.2, seconds=0.3, level="lpv", snr_db=20.0)
    return simulate_recording(looped(PAPER, level="lpv"), spec, "th1")


@pytest.mark.parametrize("kind", FORMATS)
def test_every_format_gives_the_same_arrays_by_its_name_alone(
    kind: str, experiment: Recording, tmp_path: Path
) -> None:
    columns = {"t": experiment.time, **{name: experiment[name] for name in NAMES}}
    file = FORMATS[kind](tmp_path, columns)
    found = load_recording(resolve_file(file, tmp_path), RecordingSpec(file=file), NAMES)
    np.testing.assert_allclose(found.time, experiment.time, atol=CLOCK)
    for name in NAMES:
        np.testing.assert_allclose(found[name], experiment[name], rtol=0, atol=EXACT)
    if kind != "lerobot":  # known by the JSON beside it; of others the ending says nothing
        plain = (tmp_path / file).rename(tmp_path / "recording.bin")
        assert read_table(plain).rows == len(experiment.time)


def test_a_missing_extra_is_one_sentence_with_the_command(
    experiment: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    columns = {"t": experiment.time, **{name: experiment[name] for name in NAMES}}
    file = FORMATS["hdf5"](tmp_path, columns)
    monkeypatch.setattr(reading.importlib.util, "find_spec", lambda name: None)
    said = rf"run\.h5 needs .* h5py, .*; run {re.escape(install_command('lab'))}\.$"
    with pytest.raises(InputError, match=said):
        read_table(tmp_path / file)


@pytest.mark.parametrize("kind", ["mcap", "db3", "lerobot"])
def test_the_folder_of_a_set_says_which_file_in_it_to_name(
    kind: str, experiment: Recording, tmp_path: Path
) -> None:
    columns = {"t": experiment.time, **{name: experiment[name] for name in NAMES}}
    file = FORMATS[kind](tmp_path, columns)
    folder = Path(file).parts[0]
    for ask in (lambda: read_table(tmp_path / folder), lambda: resolve_file(folder, tmp_path)):
        with pytest.raises(InputError, match=f"is a folder; name one file in it: {file}\\.$"):
            ask()


def test_a_folder_of_plain_files_names_those_that_can_be_read(tmp_path: Path) -> None:
    for name in ("b.csv", "a.csv.gz", "photo.jpg"):
        (tmp_path / name).touch()
    with pytest.raises(InputError, match=f"in it: {tmp_path.name}/a.csv.gz, {tmp_path.name}/b.csv"):
        read_table(tmp_path)
