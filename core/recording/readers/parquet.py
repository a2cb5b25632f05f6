"""Parquet tables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from core.errors import InputError
from core.recording.table import Reading, Table, TableReader, damaged

if TYPE_CHECKING:
    from pyarrow.parquet import ParquetFile

_INDEX = "__index_level_"
"""pandas stores the row numbers of a frame under such names; they are no measurement."""
MAGIC = b"PAR1"
BATCH = 50_000
"""Rows that are unpacked at once: a few MB of an ordinary table."""


class ParquetReader(TableReader):
    """One column per channel, the name with or without a unit."""

    kind = ".parquet .pq"

    def fits(self, path: Path, start: bytes) -> int:
        return int(start.startswith(MAGIC))

    def read(self, path: Path, reading: Reading) -> Table:
        import pyarrow as pa
        import pyarrow.parquet as pq

        if path.stat().st_size == 0:
            raise InputError(f"{path.name} is empty; give a table with samples.")
        try:
            with pq.ParquetFile(path) as file:
                names = _names(path, file.schema_arrow.names)
                # What the file says of itself may be wrong; what arrives is counted as well.
                reading.holds(file.metadata.num_rows, len(names))
                parts = list(_parts(path, file, names, reading))
        except (pa.ArrowException, OSError, ValueError) as error:
            if isinstance(error, InputError):
                raise
            raise damaged(path, "a Parquet table", error) from error
        if not parts:
            raise InputError(f"{path.name} has no samples; give a table with samples.")
        return Table(path.name, {name: _joined([p.pop(name) for p in parts]) for name in names})


def _names(path: Path, stored: Sequence[str]) -> list[str]:
    names = [name for name in stored if not name.startswith(_INDEX)]
    if len(set(names)) < len(names):
        doubled = next(name for k, name in enumerate(names) if name in names[:k])
        raise InputError(f"{path.name} has two columns {doubled}; rename or remove one.")
    if not names:
        raise InputError(f"{path.name} has no samples; give a table with samples.")
    return names


def _parts(
    path: Path, file: ParquetFile, names: list[str], reading: Reading
) -> Iterator[dict[str, np.ndarray]]:
    """The table in pieces of a few thousand rows, so that what unpacks without end is noticed."""
    rows, stated = 0, max(file.metadata.num_rows, 1)
    for batch in file.iter_batches(batch_size=BATCH, columns=names, use_threads=False):
        rows += batch.num_rows
        reading.holds(rows, len(names))
        reading.grew(batch.nbytes)
        reading.took(int(path.stat().st_size * rows / stated))
        yield {name: _array(batch.column(name)) for name in names}


def _joined(parts: list[np.ndarray]) -> np.ndarray:
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def _array(column: object) -> np.ndarray:
    values = np.asarray(column.to_pandas())  # type: ignore[attr-defined]
    if values.dtype.kind in "iuf":
        return values.astype(float)
    return values.astype(object)
