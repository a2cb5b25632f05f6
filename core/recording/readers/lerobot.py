"""LeRobot data sets: Parquet with vectors as cells, and a JSON that names their parts."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from core.errors import InputError
from core.recording.readers.parquet import BATCH, MAGIC
from core.recording.signals import by_length, merged
from core.recording.table import WIDEST, Reading, Table, TableReader, damaged

if TYPE_CHECKING:
    from pyarrow.parquet import ParquetFile

PLACES = ("info.json", "meta/info.json", "../meta/info.json", "../../meta/info.json")
"""Seen from the Parquet file; data sets keep it in data/chunk-000."""
LARGEST_INFO = 1_000_000
"""Bytes."""
BOOKKEEPING = ("index", "episode_index", "frame_index", "task_index", "next.done", "next.reward")
Info = dict[str, Any]


class LerobotReader(TableReader):
    """One file is one episode; `observation.state` and `action` have a column per name."""

    kind = "lerobot"
    folder = ("meta/info.json", "data/*/*.parquet")

    def fits(self, path: Path, start: bytes) -> int:
        return 2 * int(start.startswith(MAGIC) and _info(path) is not None)

    def read(self, path: Path, reading: Reading) -> Table:
        import pyarrow as pa
        import pyarrow.parquet as pq

        try:
            with pq.ParquetFile(path) as file:
                reading.holds(file.metadata.num_rows, 1)
                columns = _joined(list(_batches(path, file, reading)))
        except (pa.ArrowException, OSError, ValueError, TypeError) as error:
            if isinstance(error, InputError):
                raise
            raise damaged(path, "a Parquet table of a LeRobot data set", error) from error
        info = _info(path) or {}
        warnings = _one_episode(path, columns)
        _exact_time(columns, info.get("fps"))
        made, unusable = _named(columns, info)
        return merged(path, by_length("episode", made), reading, unusable, warnings)


def _info(path: Path) -> Info | None:
    """What the JSON beside the file says, where that is one of a LeRobot data set."""
    for place in PLACES:
        found = path.parent / place
        try:
            if not found.is_file() or found.stat().st_size > LARGEST_INFO:
                continue
            info = json.loads(found.read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError):
            continue
        if isinstance(info, dict) and isinstance(info.get("features"), dict):
            return info
    return None


def _batches(path: Path, file: ParquetFile, reading: Reading) -> Iterator[dict[str, np.ndarray]]:
    rows, stated = 0, max(file.metadata.num_rows, 1)
    for batch in file.iter_batches(batch_size=BATCH, use_threads=False):
        rows += batch.num_rows
        reading.grew(batch.nbytes)
        reading.took(int(path.stat().st_size * rows / stated))
        made = {name: _array(batch.column(name)) for name in batch.schema.names}
        reading.holds(rows, sum(1 if v.ndim == 1 else v.shape[1] for v in made.values()))
        yield made


def _array(column: Any) -> np.ndarray:
    """(N,) or, of a vector per cell, (N, k); empty where it is neither."""
    import pyarrow as pa

    kind = column.type
    if pa.types.is_list(kind) or pa.types.is_large_list(kind) or pa.types.is_fixed_size_list(kind):
        values = column.flatten().to_numpy(zero_copy_only=False)
        width = len(values) // max(len(column), 1)
        if width * len(column) != len(values) or width > WIDEST or values.dtype.kind not in "iuf":
            return np.empty((len(column), 0))
        return np.asarray(values.reshape(len(column), width))
    values = column.to_numpy(zero_copy_only=False)
    return values if values.dtype.kind in "iuf" else np.empty((len(column), 0))


def _joined(parts: list[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    if not parts:
        raise ValueError("it has no samples")
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


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
    made: dict[str, np.ndarray] = {}
    unusable: dict[str, str] = {}
    for feature, values in columns.items():
        if feature in BOOKKEEPING:
            continue
        if values.ndim == 1:
            made[feature] = values.astype(float)
        elif values.shape[1] == 0:
            unusable[feature] = "is no array of real numbers"
        else:
            names = _names(info, feature, values.shape[1])
            made |= {f"{feature}/{n}": values[:, k].astype(float) for k, n in enumerate(names)}
    return made, unusable


def _names(info: Info, feature: str, width: int) -> list[str]:
    """Of the parts of a vector: a list, or lists in a table; else their numbers from 1."""
    described = info["features"].get(feature)
    names = described.get("names") if isinstance(described, dict) else None
    if isinstance(names, dict):
        names = [each for part in names.values() if isinstance(part, list) for each in part]
    if isinstance(names, list) and len(names) == width and len(set(map(str, names))) == width:
        return [str(name).removesuffix(".pos") for name in names]
    return [str(k + 1) for k in range(width)]
