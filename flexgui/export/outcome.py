"""All files of one export."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
from pyarrow import csv

from core.diagnosed import NAME as DIAGNOSED
from core.errors import InputError
from core.results import Outcome
from flexgui.export.folder import INDEX, dumps, swap_in, work_folder
from flexgui.export.formats import model_formats
from flexgui.export.motion import Motion
from flexgui.export.report import report_html
from flexgui.export.result import result
from flexgui.export.tables import tables

DIGITS = 10
"""More than any sensor resolves, at two thirds of the size of all 17."""


def export_outcome(
    outcome: Outcome,
    scenario_text: str,
    out: Path,
    motion: Motion | None = None,
    diagnosed: str = "",
) -> None:
    """Write the export into the folder `out`; where that fails an older one stays as it was.

    `diagnosed` is the text of the scenario with what was found; empty: there is none.
    """
    try:
        with work_folder(out) as room:
            _write(outcome, scenario_text, room, motion, diagnosed)
            swap_in(room, out)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        place = f"{Path(error.filename).name}: " if isinstance(error.filename, str) else ""
        raise InputError(
            f"The export into {out} failed ({place}{reason}) and what was there before is "
            "unchanged; free some space or choose another folder with --out."
        ) from error


SMALLEST = 1e-280
"""Of the numbers that are rounded: the factor of a smaller one, such as the chance that noise looks
like a strong effect, would overflow."""


def _csv(table: pd.DataFrame, path: Path) -> None:
    """Arrow writes a recording of 10 000 rows ten times as fast as pandas does."""
    numbers = table.select_dtypes("float")
    shorter = table.assign(**{name: _rounded(numbers[name].to_numpy()) for name in numbers})
    columns = pa.Table.from_pandas(shorter, preserve_index=False)
    csv.write_csv(columns, path, csv.WriteOptions(quoting_style="needed"))


def _rounded(values: np.ndarray) -> np.ndarray:
    """Values (N,) to DIGITS significant digits."""
    usual = np.isfinite(values) & (np.abs(values) > SMALLEST)
    factor = 10.0 ** (DIGITS - 1 - np.floor(np.log10(np.where(usual, np.abs(values), 1.0))))
    return np.asarray(np.where(usual, np.round(values * factor) / factor, values))


def _write(
    outcome: Outcome, scenario_text: str, room: Path, motion: Motion | None, diagnosed: str
) -> None:
    (room / "tables").mkdir()
    for name, table in tables(outcome).items():
        _csv(table, room / "tables" / f"{name}.csv")
    _models(outcome, room)
    _text(room / "scenario.toml", scenario_text)
    if diagnosed:
        _text(room / DIAGNOSED, diagnosed)
    _text(room / "report.html", report_html(outcome, scenario_text, motion))
    written = [path for path in room.rglob("*") if path.is_file()]
    files = sorted([path.relative_to(room).as_posix() for path in written] + [INDEX])
    _text(room / INDEX, dumps(result(outcome, files)))


def _models(outcome: Outcome, room: Path) -> None:
    """The model in every format that can hold it."""
    for one in model_formats():
        if one.unable(outcome):
            continue
        for name, content in one.files(outcome).items():
            (room / name).parent.mkdir(parents=True, exist_ok=True)
            (room / name).write_bytes(content)


def _text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")
