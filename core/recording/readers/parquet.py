"""Parquet tables; LeRobot data sets are such, with vectors as cells and a JSON that names their
parts.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from ...recording.signals import by_length, merged
from ...recording.table import WIDEST, Reading, Table, TableReader, check_distinct, in_seconds

_INDEX = "__index_level_"
"""pandas stores the row numbers of a frame under such names; they are no measurement."""
MAGIC = b"PAR1"
BATCH = 50_000
"""Rows that are unpacked at once: a few MB of an ordinary table."""


class ParquetReader(TableReader):
    """One column per channel, the name with or without a unit."""

    kind = ".parquet .pq"
    file_type = "a Parquet table"

    def fits(self, path: Path, start: bytes) -> int:
        return int(start.startswith(MAGIC))

    def read(self, path: Path, reading: Reading) -> Table:
        columns = _columns(path, reading, _numbers)
        return Table(path.name, dict(in_seconds(*column) for column in columns.items()))


class LerobotReader(TableReader):
    """One file is one episode; `observation.state` and `action` have a column per name."""

    kind = "lerobot"
    file_type = "a Parquet table of a LeRobot data set"
    folder = ("meta/info.json", "data/*/*.parquet")

    def fits(self, path: Path, start: bytes) -> int:
        return 2 * int(start.startswith(MAGIC) and _info(path) is not None)

    def read(self, path: Path, reading: Reading) -> Table:
        columns, info = _columns(path, reading, _vectors), _info(path) or {}
        warnings = _one_episode(path, columns)
        _exact_time(columns, info.get("fps"))
        named, unusable = _named(columns, info)
        return merged(path, by_length("episode", named), reading, unusable, warnings)


def _columns(
    path: Path, reading: Reading, convert: Callable[[Any], np.ndarray]
) -> dict[str, np.ndarray]:
    """Name -> (N, ...), as `convert` of Arrow's columns."""
    import pyarrow.parquet as pq

    with pq.ParquetFile(path) as file:
        names = _names(path, file.schema_arrow.names)
        # What the file says of itself may be wrong; what arrives is counted as well.
        stated = file.metadata.num_rows
        reading.holds(stated, len(names))
        rows, parts = 0, []
        for batch in file.iter_batches(batch_size=BATCH, columns=names, use_threads=False):
            rows += batch.num_rows
            reading.grew(batch.nbytes)
            reading.took(int(path.stat().st_size * rows / max(stated, 1)))
            parts.append([convert(batch.column(name)) for name in names])
            reading.holds(rows, sum(int(np.prod(x.shape[1:])) for x in parts[-1]))
    if not parts:
        raise InputError(f"{path.name} has no samples; give a table with samples.")
    return dict(zip(names, map(np.concatenate, zip(*parts, strict=True)), strict=True))


def _names(path: Path, stored: Sequence[str]) -> list[str]:
    names = [name for name in stored if not name.startswith(_INDEX)]
    check_distinct(path.name, names)
    if not names:
        raise InputError(f"{path.name} has no samples; give a table with samples.")
    return names


def _numbers(column: Any) -> np.ndarray:
    values = np.asarray(column.to_pandas())
    kind = values.dtype.kind
    return values if kind in "mM" else values.astype(float if kind in "iuf" else object)


def _vectors(column: Any) -> np.ndarray:
    """(N,) or, of a vector per cell, (N, k); (N, 0) where it is neither."""
    import pyarrow as pa

    empty, lists = np.empty((len(column), 0)), (pa.types.is_list, pa.types.is_large_list)
    listed = any(is_list(column.type) for is_list in (*lists, pa.types.is_fixed_size_list))
    values = (column.flatten() if listed else column).to_numpy(zero_copy_only=False)
    width = len(values) // max(len(column), 1)
    if width * len(column) != len(values) or width > WIDEST or values.dtype.kind not in "iuf":
        return empty
    return np.asarray(values.reshape(len(column), width) if listed else values)


Info = dict[str, Any]
INFO_FILES = ("info.json", "meta/info.json", "../meta/info.json", "../../meta/info.json")
"""Seen from the Parquet file; data sets keep it in data/chunk-000."""
LARGEST_INFO = 1_000_000
"""Bytes."""
BOOKKEEPING = ("index", "episode_index", "frame_index", "task_index", "next.done", "next.reward")


def _info(path: Path) -> Info | None:
    """What the JSON beside the file says, where that is one of a LeRobot data set."""
    for place in INFO_FILES:
        file = path.parent / place
        try:
            if not file.is_file() or file.stat().st_size > LARGEST_INFO:
                continue
            info = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError):
            continue
        if isinstance(info, dict) and isinstance(info.get("features"), dict):
            return info
    return None


def _one_episode(path: Path, columns: dict[str, np.ndarray]) -> tuple[str, ...]:
    """Newer data sets keep several episodes in a file: the first one is the recording."""
    episodes = columns.get("episode_index")
    if episodes is None or np.ptp(episodes) == 0:
        return ()
    keep = episodes == episodes[0]
    for name in columns:
        columns[name] = columns[name][keep]
    count = len(np.unique(episodes))
    return (f"{path.name} holds {count} episodes; episode {episodes[0]} is read.",)


def _exact_time(columns: dict[str, np.ndarray], fps: Any) -> None:
    """The frames' times from their numbers where the file rounds them to float32."""
    frames, time = columns.get("frame_index"), columns.get("timestamp")
    if frames is None or time is None or not isinstance(fps, int | float) or not fps > 0:
        return
    exact = frames.astype(float) / float(fps)
    tolerance = 4.0 * np.finfo(np.float32).eps * max(float(np.max(np.abs(exact), initial=0.0)), 1.0)
    if np.max(np.abs(exact - time), initial=0.0) <= tolerance:
        columns["timestamp"] = exact


def _named(
    columns: dict[str, np.ndarray], info: Info
) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    named: dict[str, np.ndarray] = {}
    unusable: dict[str, str] = {}
    for feature, values in columns.items():
        if feature in BOOKKEEPING:
            continue
        if values.ndim == 1:
            named[feature] = values.astype(float)
        elif values.shape[1] == 0:
            unusable[feature] = "is not an array of real numbers"
        else:
            names = _parts(info, feature, values.shape[1])
            named |= {f"{feature}/{n}": values[:, k].astype(float) for k, n in enumerate(names)}
    return named, unusable


def _parts(info: Info, feature: str, width: int) -> list[str]:
    """Names of the parts of a vector: a list, or lists in a table; else their numbers from 1."""
    described = info["features"].get(feature)
    names = described.get("names") if isinstance(described, dict) else None
    if isinstance(names, dict):
        names = [each for part in names.values() if isinstance(part, list) for each in part]
    if isinstance(names, list) and len(names) == width and len(set(map(str, names))) == width:
        return [str(name).removesuffix(".pos") for name in names]
    return [str(k + 1) for k in range(width)]
