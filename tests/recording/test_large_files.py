"""Files that are large, or that unpack to something large."""

from __future__ import annotations

import gzip
import io
import struct
import tracemalloc
import zlib
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.csv  # noqa: F401  (its import is not to be measured)
import pyarrow.parquet as pq
import pytest
from backports import zstd
from scipy.io import savemat

from flexgui.core.errors import InputError
from flexgui.core.progress import Silent
from flexgui.core.recording import table
from flexgui.core.recording.load import load_recording
from flexgui.core.recording.read_table import read_table
from flexgui.core.recording.readers import delimited
from flexgui.core.recording.spec import RecordingSpec

SMALL = 2_000_000
"""Bytes that a file may unpack to in these tests, so that a bomb is quickly made."""
ROOM = 12 * SMALL
"""Bytes that may be in use meanwhile: what has come, its copy in one piece, and a block."""
LARGE = 40 * SMALL


def mat_of_zeros(size: int) -> bytes:
    """A compressed variable x of `size` int8 zeros; a thousandth of them as a file."""

    def element(kind: int, data: bytes) -> bytes:
        return struct.pack("<II", kind, len(data)) + data + b"\0" * (-len(data) % 8)

    head = element(6, struct.pack("<II", 8, 0)) + element(5, struct.pack("<ii", size, 1))
    body = head + element(1, b"x") + element(1, bytes(size))
    packed = zlib.compress(struct.pack("<II", 14, len(body)) + body)
    mark = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    return mark + struct.pack("<II", 15, len(packed)) + packed


def parquet_of_zeros(size: int) -> bytes:
    room = io.BytesIO()
    pq.write_table(pa.table({"t": np.zeros(size // 8)}), room)
    return room.getvalue()


def npz_of_zeros(size: int) -> bytes:
    room = io.BytesIO()
    np.savez_compressed(room, t=np.zeros(size // 8))
    return room.getvalue()


def hdf5_of_zeros(size: int) -> bytes:
    room = io.BytesIO()
    with h5py.File(room, "w") as file:
        file.create_dataset("t", data=np.zeros(size // 8), compression="gzip")
    return room.getvalue()


def mcap_of_zeros(size: int) -> bytes:
    """One chunk that says it unpacks to a byte."""
    packed = zstd.compress(bytes(size))
    body = struct.pack("<QQQII", 0, 0, 1, 0, 4) + b"zstd" + struct.pack("<Q", len(packed)) + packed
    return b"\x89MCAP0\r\n" + struct.pack("<BQ", 6, len(body)) + body


BOMBS: dict[str, Callable[[int], bytes]] = {
    "one.mat": mat_of_zeros,
    "rows.csv.gz": lambda size: gzip.compress(b"t,theta1\n" + b"0,0\n" * (size // 4)),
    "line.csv.gz": lambda size: gzip.compress(b"t,theta1\n" + b"0" * size),
    "blank.csv.gz": lambda size: gzip.compress(b"t,theta1\n" + b"\n" * size),
    "zeros.parquet": parquet_of_zeros,
    "zeros.npz": npz_of_zeros,
    "zeros.h5": hdf5_of_zeros,
    "zeros.mcap": mcap_of_zeros,
}


@pytest.mark.parametrize("file", BOMBS)
def test_what_unpacks_to_too_much_is_refused_before_memory_is_taken(
    file: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(table, "MOST_BYTES", SMALL)
    path = tmp_path / file
    path.write_bytes(BOMBS[file](LARGE))
    assert path.stat().st_size < SMALL
    tracemalloc.start()
    try:
        with pytest.raises(InputError) as caught:
            read_table(path)
        assert tracemalloc.get_traced_memory()[1] < ROOM
    finally:
        tracemalloc.stop()
    assert file in str(caught.value) and "more than" in str(caught.value)


@pytest.mark.parametrize(("limit", "word"), [("MOST_ROWS", "samples"), ("MOST_CELLS", "numbers")])
@pytest.mark.parametrize("kind", ["csv", "mat", "parquet"])
def test_rows_and_numbers_are_counted(
    limit: str, word: str, kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, columns = tmp_path / f"th1.{kind}", {"t": np.arange(300.0), "x": np.zeros(300)}
    if kind == "csv":
        path.write_text("t,x\n" + "".join(f"{k},0\n" for k in range(300)))
    elif kind == "mat":
        savemat(path, columns)
    else:
        pq.write_table(pa.table(columns), path)
    assert read_table(path).rows == 300
    monkeypatch.setattr(table, limit, 250)
    with pytest.raises(InputError, match=f"th1.{kind} has more than 250 {word}"):
        read_table(path)


class Heard(Silent):
    """Notes what it is told; stops at the n-th word."""

    def __init__(self, patience: int = 10**9) -> None:
        self.words: list[str] = []
        self.patience = patience

    def advance(self, n: int = 1, text: str = "") -> None:
        assert n == 0, "a part of a file is no whole step"
        self.words.append(text)

    def stopped(self) -> bool:
        return len(self.words) >= self.patience


def long_csv(path: Path, rows: int) -> Path:
    path.write_text("t,theta1\n" + "".join(f"{k * 1e-3:.3f},{k}\n" for k in range(rows)))
    return path


def test_how_much_is_read_is_told_from_the_first_moment_on_and_a_stop_ends_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(delimited, "BLOCK", 1000)
    heard = Heard()
    path = long_csv(tmp_path / "th1.csv", 1000)
    load_recording(path, RecordingSpec(file="th1.csv"), progress=heard)
    assert heard.words[0] == "th1.csv, 0% read" and heard.words[-1] == "th1.csv, 100% read"
    assert len(heard.words) > 10
    with pytest.raises(InputError, match=r"Stopped while th1\.csv was read"):
        read_table(path, Heard(patience=3))


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("block", [7, 64, 10**6])
@pytest.mark.parametrize("last", ["", "\n", "\n\n \n"])
def test_a_table_is_the_same_in_blocks_of_any_size(
    end: str, block: int, last: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where cells need care: signs, blanks, quotes, words in a column that nobody reads."""
    monkeypatch.setattr(delimited, "BLOCK", block)
    values = [0.1, -2.5e-3, 7.0, 1e300, 3.25, float("nan")] * 4
    cells = ["0.1", "-2.5e-3", "+7", " 1e300 ", '"3.25"', "NaN"] * 4
    lines = ["x,note,z", *(f"{cell},word {k},{k}" for k, cell in enumerate(cells))]
    path = tmp_path / "th1.csv"
    path.write_bytes((end.join(lines) + last.replace("\n", end)).encode())
    table = read_table(path)
    np.testing.assert_array_equal(table.numbers("x"), values)
    np.testing.assert_array_equal(table.numbers("z"), np.arange(24.0))
    assert list(table.columns) == ["x", "note", "z"]
    assert bool(table.warnings) == (last == "")
    with pytest.raises(InputError, match=r"column note holds 'word 0' in data row 1 \(line 2\)"):
        table.numbers("note")


def test_arrow_and_python_read_the_same_number(tmp_path: Path) -> None:
    """All digits of random doubles over the whole range."""
    bits = np.random.default_rng(3).integers(0, 2**63, 5000, dtype=np.uint64)
    numbers = bits.view(np.float64)
    numbers = numbers[np.isfinite(numbers)]
    path = tmp_path / "th1.csv"
    path.write_text("t,x\n" + "".join(f"{k},{x!r}\n" for k, x in enumerate(numbers.tolist())))
    np.testing.assert_array_equal(read_table(path).numbers("x"), numbers)


def test_a_blank_line_between_blocks_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(delimited, "BLOCK", 9)
    path = tmp_path / "th1.csv"
    path.write_text("t,x\n1,2\n3,4\n\n\n\n\n\n\n\n\n\n\n\n5,6\n")
    with pytest.raises(InputError, match=r"data row 3 \(line 4\) has 0 fields"):
        read_table(path)
