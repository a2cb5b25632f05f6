"""Bad files: one sentence that names the file and what is wrong in it, and no other error."""

from __future__ import annotations

import gzip
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from flexgui.core.errors import InputError
from flexgui.core.recording.load import load_recording
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.save import save_recording
from flexgui.core.recording.spec import RecordingSpec

ROWS = 30
NAMES = ("t", "dtheta1_ref", "theta1", "u1", "z1")
COMPLETE = ("dtheta1_ref", "theta1", "u1")
EXAMPLES = 25
"""Per kind of damage; a case takes a few milliseconds."""

Lines = list[list[str]]
Damage = st.SearchStrategy[tuple[str, ...]]
"""A damaged file, and what must be said of it."""
quick = settings(max_examples=EXAMPLES, deadline=None, suppress_health_check=[HealthCheck.too_slow])


def good_lines() -> Lines:
    body = [[f"{1e-3 * k:.3f}", *(f"{np.sin(k + c):.6f}" for c in range(4))] for k in range(ROWS)]
    return [list(NAMES), *body]


def sentence(content: str | bytes, file: str = "th1.csv") -> str:
    """What reading the content as `file` says; fails where it says nothing or is no sentence."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / file
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        with pytest.raises(InputError) as caught:
            load_recording(path, RecordingSpec(file=file), required=("theta1", "z1"))
    text = str(caught.value)
    assert text
    assert "\n" not in text
    assert file in text
    assert text.endswith((".", "?"))
    return text


def joined(lines: Lines) -> str:
    return "\n".join(",".join(line) for line in lines) + "\n"


def changed(row: int, column: str, cell: str) -> str:
    lines = good_lines()
    lines[row][NAMES.index(column)] = cell
    return joined(lines)


def at(row: int) -> str:
    return f"data row {row} (line {row + 1})"


def test_the_undamaged_file_is_read(tmp_path):
    path = tmp_path / "th1.csv"
    path.write_text(joined(good_lines()))
    assert len(load_recording(path, RecordingSpec(file="th1.csv")).time) == ROWS


WORDS = st.text("abcxyz!?%&éß一", min_size=1, max_size=8) | st.sampled_from(
    ["1.2.3", "1e", "-", "--1", "0x1F", "1_000", "#REF!", "true", "1 2"]
)
ROW = st.integers(1, ROWS)


def cells(columns: tuple[str, ...], content: st.SearchStrategy[str]) -> Damage:
    """One cell of some columns holds something else."""
    return st.builds(
        lambda row, column, cell: (changed(row, column, cell), at(row), column),
        ROW, st.sampled_from(columns), content,
    )  # fmt: skip


def gap(row: int, missing: int) -> tuple[str, ...]:
    lines = good_lines()
    for line in lines[row:]:
        line[0] = f"{float(line[0]) + 1e-3 * missing:.3f}"
    return joined(lines), at(row), "t", "not uniform"


def too_few(row: int, fields: int) -> tuple[str, ...]:
    lines = good_lines()
    lines[row] = lines[row][:fields]
    if row == ROWS and fields == 0:
        lines.append(good_lines()[row])  # an empty last line is no fault
    return joined(lines), at(row)


def too_many(row: int, more: int) -> tuple[str, ...]:
    lines = good_lines()
    lines[row] += ["1.0"] * more
    return joined(lines), at(row)


def headed(column: str, heading: str, *words: str) -> tuple[str, ...]:
    """With another heading of a column."""
    return joined([[heading if n == column else n for n in NAMES], *good_lines()[1:]]), *words


def without(column: str) -> tuple[str, ...]:
    index = NAMES.index(column)
    lines = [[*line[:index], *line[index + 1 :]] for line in good_lines()]
    return joined(lines), f"no column {column}"


def doubled(first: str) -> tuple[str, ...]:
    lines = [[*line, line[NAMES.index(first)]] for line in good_lines()]
    return joined(lines), f"two columns {first}"


NEEDED = st.sampled_from(["t", "theta1", "z1"])
DAMAGES: dict[str, Damage] = {
    "a cell is empty": cells(COMPLETE, st.sampled_from(["", "NaN", "nan", " ", "NA"])),
    "a cell is text": cells(NAMES, WORDS),
    "a cell is infinite": cells(NAMES, st.sampled_from(["inf", "-inf", "1e999"])),
    "time falls back": st.builds(
        lambda row, back: (changed(row, "t", f"{(1 - back) * 1e-3 * (row - 2):.9f}"), at(row), "t"),
        st.integers(2, ROWS), st.floats(0.0, 1.0),
    ),
    "time has a gap": st.builds(gap, st.integers(3, ROWS - 1), st.integers(2, 50)),
    "a row has too few fields": st.builds(too_few, ROW, st.integers(0, len(NAMES) - 1)),
    "a row has too many fields": st.builds(too_many, ROW, st.integers(1, 3)),
    "a column is renamed": st.builds(lambda n: headed(n, f"my_{n}", f"no column {n}"), NEEDED),
    "a column is missing": st.builds(without, NEEDED),
    "a column is doubled": st.builds(doubled, st.sampled_from(NAMES)),
    "a unit does not fit": st.builds(
        lambda n, unit: headed(n, f"{n} [{unit}]", f"column {n} [{unit}]"), st.sampled_from(NAMES),
        st.sampled_from(["N s", "degC", "m^3", "kg", "?", "9", "lx"]),
    ),
    "there are no samples": st.just((joined(good_lines()[:1]), "no samples")),
    "there are too few samples": st.builds(
        lambda n: (joined(good_lines()[: n + 1]), f"{n} samples"), st.integers(1, 9)
    ),
}  # fmt: skip


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
@quick
@given(data=st.data())
def test_damage_is_named_with_its_place(damage, data):
    content, *words = data.draw(damage)
    text = sentence(content)
    for word in words:
        assert word in text


@pytest.mark.parametrize("file", ["th1.csv", "th1.csv.gz", "th1.parquet", "th1.mat"])
@pytest.mark.parametrize("content", [b"", b"\n\n", b"\0\0\0\0", b"\x1f\x8b", b"PAR1", b"<html>"])
def test_content_that_is_no_table_is_refused(file, content):
    sentence(content, file)


def _bytes_of(file: str) -> bytes:
    rng = np.random.default_rng(5)
    channels = {name: rng.normal(size=ROWS) for name in (*COMPLETE, "z1")}
    recording = Recording("th1", 1e-3 * np.arange(ROWS), channels)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / file
        if file.endswith(".mat"):
            from scipy.io import savemat

            packed = not file.startswith("plain")
            savemat(path, {"t": recording.time, **channels}, do_compression=packed)
        else:
            save_recording(recording, path)
        return path.read_bytes()


KINDS = ("th1.csv.gz", "th1.parquet", "th1.mat", "plain.mat")
BINARY = {file: _bytes_of(file) for file in KINDS}


@quick
@given(st.sampled_from(sorted(BINARY)), st.floats(0.0, 0.98))
def test_a_binary_file_cut_short_is_refused(file, part):
    content = BINARY[file]
    sentence(content[: int(part * len(content))], file)


def only_input_errors(action: Callable[[], object], file: str) -> None:
    """The action succeeds or says one line that names the file."""
    try:
        action()
    except InputError as error:
        assert "\n" not in str(error)
        assert file in str(error)


@quick
@given(st.sampled_from(sorted(BINARY)), st.data())
def test_a_binary_file_with_wrong_bytes_ends_in_a_sentence_at_worst(file, data):
    content = bytearray(BINARY[file])
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / file
        path.write_bytes(content)
        only_input_errors(lambda: load_recording(path, RecordingSpec(file=file)), file)


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_any_text_ends_in_a_sentence_at_worst(data):
    cells = st.sampled_from(
        [*NAMES, "", "1", "0.5", '"', "nan", "a;b", "\t", "é", "1e3", "'", "[m]"]
    )
    lines = data.draw(st.lists(st.lists(cells, max_size=5), max_size=14))
    ends = data.draw(st.sampled_from(["\n", "\r\n", "\r"]))
    content = ends.join(",".join(line) for line in lines)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "th1.csv"
        path.write_bytes(content.encode())
        only_input_errors(lambda: load_recording(path, RecordingSpec(file="th1.csv")), "th1.csv")


def test_a_file_cut_anywhere_is_refused_or_warned_of(tmp_path):
    whole = joined(good_lines())
    path = tmp_path / "th1.csv"
    for length in range(len(whole) - 200, len(whole) - 1, 7):
        path.write_text(whole[:length])
        try:
            warnings = load_recording(path, RecordingSpec(file="th1.csv")).warnings
        except InputError as error:
            assert "th1.csv" in str(error)
        else:
            assert whole[length - 1] == "\n" or any("cut short" in w for w in warnings)


def test_missing_file_folder_and_unknown_kind_are_told_apart(tmp_path):
    (tmp_path / "folder.csv").mkdir()
    (tmp_path / "th1.xlsx").write_bytes(b"PK\x03\x04" + bytes(100))
    for file, words in (
        ("gone.csv", "does not exist"),
        ("folder.csv", "is a folder"),
        ("th1.xlsx", "has a file type that cannot be read"),
    ):
        with pytest.raises(InputError, match=words) as caught:
            load_recording(tmp_path / file, RecordingSpec(file=file))
        assert file in str(caught.value)


def test_gzip_of_a_bad_table_names_the_row():
    text = sentence(gzip.compress(changed(7, "theta1", "").encode()), "th1.csv.gz")
    assert at(7) in text and "theta1" in text


@pytest.mark.parametrize("lines", [1, 30])
def test_a_text_that_is_no_table_is_not_quoted(lines: int) -> None:
    text = "Dear diary, today\n" + "nothing happened, really\n" * lines
    for file in ("notes.txt", "notes.csv"):
        said = sentence(text, file)
        assert "not a table" in said and "diary" not in said and "happened" not in said


def test_a_second_heading_of_words_is_a_slip_and_no_text() -> None:
    lines = good_lines()
    lines.insert(1, ["clock", "command", "encoder", "motor", "camera"])
    assert at(1) in sentence(joined(lines))
