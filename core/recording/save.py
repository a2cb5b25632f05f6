"""Writing a recording as a table that `load_recording` reads back."""

from __future__ import annotations

import gzip
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError
from ..files import replacing
from ..recording.channels import channel_kind
from ..recording.recording import Recording
from ..units import factor_to_si

if TYPE_CHECKING:
    from pandas import DataFrame


def save_recording(
    recording: Recording, path: Path, units: Mapping[str, str] | None = None
) -> None:
    """Write time and channels as .csv, .csv.gz or .parquet, by the name of `path`; else InputError.

    Headers carry the SI unit where the channel has only one, or where `units` states it. Masks,
    filters and roles belong to the scenario, not to the file.
    """
    suffix = next((s for s in _WRITERS if path.name.lower().endswith(s)), None)
    if suffix is None:
        raise InputError(f"{path.name} cannot be written; known: {', '.join(sorted(_WRITERS))}.")
    frame = recording_frame(recording, units or {})
    with replacing(path) as temporary:
        _WRITERS[suffix](frame, temporary)


def recording_frame(recording: Recording, units: Mapping[str, str]) -> DataFrame:
    """Time and channels as a table, as `save_recording` writes it."""
    import pandas as pd

    columns = {}
    for name, values in {"t": recording.time, **recording.channels}.items():
        si_units = channel_kind(name).units
        unit = units.get(name, si_units[0] if len(si_units) == 1 else "")
        header = f"{name} [{unit}]" if unit else name
        factor = factor_to_si(unit, si_units)
        columns[header] = values if factor == 1.0 else values / factor
    return pd.DataFrame(columns)


def _write_csv(frame: DataFrame, path: Path) -> None:
    # pandas writes the shortest text that reads back as the same number.
    path.write_text(frame.to_csv(index=False, lineterminator="\n"), encoding="utf-8")


def _write_gzip(frame: DataFrame, path: Path) -> None:
    text = frame.to_csv(index=False, lineterminator="\n").encode()
    path.write_bytes(gzip.compress(text, mtime=0))  # no date inside: same data, same bytes


def _write_parquet(frame: DataFrame, path: Path) -> None:
    frame.to_parquet(path, index=False)


_WRITERS = {".csv": _write_csv, ".csv.gz": _write_gzip, ".parquet": _write_parquet}
