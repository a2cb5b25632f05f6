"""Mutated recordings, scenarios, archives and command lines, each from a number."""

from __future__ import annotations

import gzip
import io
import re
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from scipy.io import savemat

from tests.cli.helpers import COLUMNS, FILE, SCENARIO, TEXT, csv, swapped, table
from tests.recording.lab_formats import FORMATS

Rng = np.random.Generator
SIMULATED = swapped(
    'file = "th1.csv"\ntheta2 = 1.2',
    "simulate = {theta2 = 1.2, seconds = 0.2, snr_db = 20.0, seed = 3, amplitude = 0.3, "
    "hold = 0.02, sample_time = 1e-3}",
)
NUMBERS = (
    "0", "-1", "1", "0.5", "nan", "inf", "-inf", "1e300", "-1e300", "1e-300", "1e308", "1e16",
    "1e9", "1e5", "1e4", "1e3", "-1e3", "1e-9", "1e-3", "9223372036854775808", "4294967296", "true",
    '"x"', "[]", "[1.0]", "{}", "''", "[[1.0]]", "{a = 1}",
)  # fmt: skip
CELLS = (
    "", "nan", "inf", "-inf", "1e300", "-1e300", "1e160", "1e15", "1e9", "-5", "0", "abc", "1,5",
    '"', '"1"', "1e", "0x10", "1_0", "\t", ";", "é", "\x00", "9" * 400, "=1+1", "true",
)  # fmt: skip
LINES = (
    "[arm]", "[[recordings]]", "[[recordings]]\nsimulate = {}", "[model]", "x = 1", "[diagnose]",
    "max_effects = 1", 'compare = 3', "[[compare]]\ntitle = 'x'", "= 1", "\x00", "[[model.own]]",
    'columns = {theta1 = "z1"}', "window = [0.0, 0.01]", "decimate = 50", "initial_state = true",
    'output = ["z", "encoder"]', 'filter = {cutoff_hz = 30.0}', "servo_hz = 1e9",
    'offsets = ["z1"]', "time_shift = 1e-3", "camera = {scale = 1e15}", "hidden = {}",
)  # fmt: skip
PLACES = ("", ".", "..", "/", "/dev/null", "/dev/zero", "/proc/self/mem", "out", "x/y", "a" * 300,
          "a" * 5000, "-", "--", "*", "\n", "é", "\udc80", SCENARIO, FILE, f"{SCENARIO}/x",
          "nowhere.toml", "nowhere.zip")  # fmt: skip
WORDS = ("export", "check", "plan", "study", "nonsense", "--out", "--data", "--quiet",
         "--seed", "--level", "--runs", "--part", "--help", "--version", "--cluster", "-x", "1",
         "-1", "1e9", "easy", "hard", "none", "99999999999999999999")  # fmt: skip


@dataclass(frozen=True)
class Case:
    """What lies in the folder and what is asked of the command line."""

    label: str
    arguments: tuple[str, ...]
    files: dict[str, bytes] = field(default_factory=dict)


EXPORT = ("export", SCENARIO, "--out", "out")


def _with(name: str, content: bytes, text: str = TEXT) -> dict[str, bytes]:
    return {SCENARIO: text.replace(FILE, name).encode(), name: content}


def pick(rng: Rng, choices: tuple[str, ...]) -> str:
    return choices[int(rng.integers(len(choices)))]


def with_wrong_bytes(content: bytes, rng: Rng) -> bytes:
    """Changed, cut out, doubled or put in, at up to eight places; sometimes cut short."""
    found = bytearray(content)
    for _ in range(int(rng.integers(1, 9))):
        at, length = int(rng.integers(len(found) + 1)), int(rng.integers(1, 17))
        how = int(rng.integers(5))
        if how == 0:
            found[at : at + 1] = rng.bytes(1)
        elif how == 1:
            del found[at : at + length]
        elif how == 2:
            found[at:at] = found[at : at + length]
        elif how == 3:
            found[at:at] = rng.bytes(length)
        elif how == 4 and rng.random() < 0.2:
            del found[at:]
    return bytes(found)


@cache
def columns() -> dict[str, np.ndarray]:
    rows = np.array(table()[1:], dtype=float)
    return dict(zip(COLUMNS, rows.T, strict=True))


@cache
def binary(kind: str) -> bytes:
    """The undamaged recording."""
    room = io.BytesIO()
    if kind.endswith("mat"):
        savemat(room, columns(), do_compression=kind.startswith("packed"))
    elif kind.endswith("parquet"):
        pq.write_table(pa.table(columns()), room)
    else:
        return gzip.compress(csv(table()).encode(), mtime=0)
    return room.getvalue()


@cache
def zipped(kind: int) -> bytes:
    """A scenario and its recording in one file."""
    room = io.BytesIO()
    with zipfile.ZipFile(room, "w", kind) as archive:
        archive.writestr("scenario.toml", TEXT)
        archive.writestr(FILE, csv(table()))
    return room.getvalue()


def cells(rng: Rng) -> Case:
    lines = table()
    for _ in range(int(rng.integers(1, 4))):
        row, column = int(rng.integers(len(lines))), int(rng.integers(len(COLUMNS)))
        lines[row][column] = pick(rng, CELLS)
    return Case("cells", EXPORT, _with(FILE, csv(lines).encode()))


def text_bytes(rng: Rng) -> Case:
    return Case("csv", EXPORT, _with(FILE, with_wrong_bytes(csv(table()).encode(), rng)))


@cache
def lab_file(kind: str) -> tuple[str, bytes]:
    """The name and the content of the undamaged recording in a laboratory's format."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / FORMATS[kind](Path(folder), columns())
        return file.name, file.read_bytes()


def lab_bytes(kind: str) -> Callable[[Rng], Case]:
    def make(rng: Rng) -> Case:
        name, content = lab_file(kind)
        return Case(kind, EXPORT, _with(name, with_wrong_bytes(content, rng)))

    return make


def binary_bytes(kind: str) -> Callable[[Rng], Case]:
    def make(rng: Rng) -> Case:
        return Case(kind, EXPORT, _with(kind, with_wrong_bytes(binary(kind), rng)))

    return make


def numbers(rng: Rng) -> Case:
    """One to three numbers of a scenario replaced."""
    text = TEXT if rng.random() < 0.4 else SIMULATED
    for _ in range(int(rng.integers(1, 4))):
        found = list(re.finditer(r"(?<=[ =\[{])-?\d+(\.\d+)?(e-?\d+)?", text))
        chosen = found[int(rng.integers(len(found)))]
        text = text[: chosen.start()] + pick(rng, NUMBERS) + text[chosen.end() :]
    return Case("numbers", EXPORT, _with(FILE, csv(table()).encode(), text))


def lines(rng: Rng) -> Case:
    """Lines of a scenario put in, doubled and left out."""
    text = (TEXT if rng.random() < 0.5 else SIMULATED).splitlines()
    for _ in range(int(rng.integers(1, 4))):
        at = int(rng.integers(len(text)))
        how = int(rng.integers(3))
        text[at : at + (how == 2)] = [pick(rng, LINES) if how == 0 else text[at]] * (how != 2)
    return Case("lines", EXPORT, _with(FILE, csv(table()).encode(), "\n".join(text)))


def scenario_bytes(rng: Rng) -> Case:
    files = _with(FILE, csv(table()).encode())
    return Case("toml", EXPORT, {**files, SCENARIO: with_wrong_bytes(TEXT.encode(), rng)})


def zips(rng: Rng) -> Case:
    kinds = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)
    content = with_wrong_bytes(zipped(kinds[int(rng.integers(4))]), rng)
    return Case("zip", ("unpack", "work.zip"), {"work.zip": content})


def commands(rng: Rng) -> Case:
    words = [pick(rng, PLACES) if rng.random() < 0.4 else pick(rng, WORDS) for _ in range(5)]
    length = int(rng.integers(1, 6))
    if rng.random() < 0.6:
        words = [*EXPORT]
        words[int(rng.integers(1, 4))] = pick(rng, PLACES)
        length = 4
    return Case("command", tuple(words[:length]), _with(FILE, csv(table()).encode()))


LAB = ("csv_de", "mat73", "hdf5", "mcap", "db3", "tdms", "mdf4", "npz")
FAMILIES: tuple[Callable[[Rng], Case], ...] = (
    cells, text_bytes, numbers, numbers, lines, scenario_bytes, zips, commands,
    binary_bytes("plain.mat"), binary_bytes("packed.mat"), binary_bytes("th1.parquet"),
    binary_bytes("th1.csv.gz"), *(lab_bytes(kind) for kind in LAB),
)  # fmt: skip


def case(seed: int, number: int) -> Case:
    """The number-th case; the families take turns."""
    return FAMILIES[number % len(FAMILIES)](np.random.default_rng([seed, number]))
