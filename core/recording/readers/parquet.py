"""Parquet tables."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from core.errors import InputError
from core.recording.table import Table, TableReader, damaged

_INDEX = "__index_level_"
"""pandas stores the row numbers of a frame under such names; they are no measurement."""


class ParquetReader(TableReader):
    """One column per channel, the name with or without a unit."""

    kind = ".parquet .pq"

    def read(self, path: Path) -> Table:
        import pyarrow as pa
        import pyarrow.parquet as pq

        if path.stat().st_size == 0:
            raise InputError(f"{path.name} is empty; give a table with samples.")
        try:
            table = pq.ParquetFile(path).read()
        except (pa.ArrowException, OSError, ValueError) as error:
            raise damaged(path, "a Parquet table", error) from error
        names = [name for name in table.column_names if not name.startswith(_INDEX)]
        doubled = sorted({name for name in names if names.count(name) > 1})
        if doubled:
            raise InputError(f"{path.name} has two columns {doubled[0]}; rename or remove one.")
        if not names or table.num_rows == 0:
            raise InputError(f"{path.name} has no samples; give a table with samples.")
        return Table(path.name, {name: _array(table.column(name)) for name in names})


def _array(column: object) -> np.ndarray:
    values = np.asarray(column.to_pandas())  # type: ignore[attr-defined]
    if values.dtype.kind in "iuf":
        return values.astype(float)
    return values.astype(object)
