"""Writes all files of one export, also directly from a scenario file."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from threading import Thread

import numpy as np
import pandas as pd
import pyarrow as pa
from pyarrow import csv

from flexgui.core.diagnosed_scenario import found_texts
from flexgui.core.errors import InputError
from flexgui.core.processors import is_limited, threads_beside
from flexgui.core.progress import Progress
from flexgui.core.results import Outcome
from flexgui.core.scenario.data_folder import ConfinedFolder, resolve_file
from flexgui.export.figures import OURS, packed_plotly
from flexgui.export.folder import INDEX, check_writable, dumps, swap_in, work_folder
from flexgui.export.formats import model_formats
from flexgui.export.report import report_html
from flexgui.export.report_motion import Motion, report_motion
from flexgui.export.result import result
from flexgui.export.saved_run import FILE, SavedRun, Source, read_run, run_bytes
from flexgui.export.tables import tables
from flexgui.export.template import environment
from flexgui.views.summary import result_lines, warning_lines

DIGITS = 10
"""More than any sensor resolves, at two thirds of the size of all 17."""


def export_outcome(
    outcome: Outcome,
    scenario_text: str,
    out: Path,
    motion: Callable[[], Motion | None] = lambda: None,
    beside: Mapping[str, bytes] | None = None,
    whole: bool = True,
) -> None:
    """Write the export into the folder `out`; where that fails (InputError) an older one stays as
    it was.

    Args:
        outcome: What was found.
        scenario_text: The scenario's own text.
        out: The folder; made where it is missing.
        motion: Makes the player while others write models and tables.
        beside: Further files, name -> content.
        whole: Whether report, tables and models are written too.
    """
    content = {"scenario.toml": scenario_text.encode(), **(beside or {})}
    try:
        with work_folder(out) as folder:
            if whole:
                _write_views(outcome, scenario_text, folder, motion)
            for name, each in content.items():
                (folder / name).write_bytes(each)
            written = [path for path in folder.rglob("*") if path.is_file()]
            files = sorted([path.relative_to(folder).as_posix() for path in written] + [INDEX])
            _text(folder / INDEX, dumps(result(outcome, files)))
            swap_in(folder, out)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        place = f"{Path(error.filename).name}: " if isinstance(error.filename, str) else ""
        raise InputError(
            f"The export into {out} failed ({place}{reason}). The earlier files there are "
            f"unchanged. Free some space, or choose another folder with --out."
        ) from None


SMALLEST_ROUNDED = 1e-280
"""Smallest rounded number: the factor of a smaller one would overflow."""


def _csv(table: pd.DataFrame, path: Path) -> None:
    """Arrow writes a recording of 10 000 rows ten times as fast as pandas does."""
    numbers = table.select_dtypes("float")
    shorter = table.assign(**{name: _rounded(numbers[name].to_numpy()) for name in numbers})
    columns = pa.Table.from_pandas(shorter, preserve_index=False)
    csv.write_csv(columns, path, csv.WriteOptions(quoting_style="needed"))


def _rounded(values: np.ndarray) -> np.ndarray:
    """Values (N,) to DIGITS significant digits."""
    usual = np.isfinite(values) & (np.abs(values) > SMALLEST_ROUNDED)
    factor = 10.0 ** (DIGITS - 1 - np.floor(np.log10(np.where(usual, np.abs(values), 1.0))))
    return np.asarray(np.where(usual, np.round(values * factor) / factor, values))


def _write_views(
    outcome: Outcome, scenario_text: str, folder: Path, motion: Callable[[], Motion | None]
) -> None:
    with threads_beside(2) as beside:  # a C compiler and Arrow work there
        jobs = [beside.submit(write, outcome, folder) for write in (_models, _tables)]
        _text(folder / "report.html", report_html(outcome, scenario_text, motion()))
        for job in jobs:
            job.result()


def _tables(outcome: Outcome, folder: Path) -> None:
    (folder / "tables").mkdir()
    for name, table in tables(outcome).items():
        _csv(table, folder / "tables" / f"{name}.csv")


def _models(outcome: Outcome, folder: Path) -> None:
    """The model in every format that can hold it."""
    for model_format in model_formats():
        if model_format.unable(outcome):
            continue
        for name, content in model_format.files(outcome).items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)


def _text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")


def export_scenario(
    path: Path, out: Path, data: Path | None, progress: Progress,
    print_line: Callable[[str], None], check: bool = True,
) -> tuple[str, ...]:  # fmt: skip
    """Reads, runs and exports a scenario, and returns closing lines; checks input first
    (InputError).

    `print_line` gets which files lie outside the scenario's folder and the data folder; `check`:
    whether the recordings are checked for faults.
    """
    from flexgui.core.scenario.data_folder import outside
    from flexgui.core.scenario.read import read_scenario

    if data is not None and not data.is_dir():
        raise InputError(f"--data {data} is no folder; name the one that holds the recordings.")
    scenario = read_scenario(path)
    text = path.read_text(encoding="utf-8-sig")
    check_writable(out)
    if far := outside(scenario, path.parent, data):
        print_line(far)

    from flexgui.core.precompile import precompile_all
    from flexgui.core.scenario.stated_effects import arms_to_compile

    precompile_all(progress, arms_to_compile(scenario))

    from flexgui.core.workbench import run_scenario

    if not is_limited():
        Thread(target=_prepare, daemon=True).start()
    outcome = run_scenario(
        scenario, folder=path.parent, data_folder=data, progress=progress, check=check
    )

    progress.stage("Writing the report")
    export_run(outcome, Source(scenario, text, path.parent, data), out)
    return _closing_lines(outcome, out)


def _prepare() -> None:
    """Loads and packs what no result changes, while the fits use the other processor."""
    packed_plotly(OURS)
    environment().get_template("report.html.j2")
    if find_spec("viser") is not None:
        import flexgui.scene.motion_page  # noqa: F401


def export_again(folder: Path, out: Path, data: Path | None) -> tuple[str, ...]:
    """Exports the run that was saved into a folder; nothing is computed again."""
    run = read_run(folder)
    check_writable(out)
    export_run(run.outcome, run.source(folder, data), out)
    return _closing_lines(run.outcome, out)


def _closing_lines(outcome: Outcome, out: Path) -> tuple[str, ...]:
    report = f"The report is {out / 'report.html'}."
    return (*warning_lines(outcome), *result_lines(outcome), report)


def export_run(outcome: Outcome, source: Source, out: Path, whole: bool = True) -> None:
    """`export_outcome` with the motion of a recording, the scenarios with what was found, and the
    run itself, to be opened again."""
    scenario, folder, data, tables = source.scenario, source.folder, source.data, source.tables
    if tables or isinstance(folder, ConfinedFolder):  # its files go with the export
        home: Path = out
        locate: Callable[[str], str] = str
    else:
        home, locate = folder, seen_by(out, folder, data)
    further = None if data is None else seen_from(data, out)
    held = {path.name: path.read_bytes() for path in sorted(tables)}
    run = SavedRun(scenario, outcome, source.text, seen_from(home, out), further, tuple(held))
    texts = found_texts(scenario, outcome, locate)
    beside = {FILE: run_bytes(run), **held, **{name: t.encode() for name, t in texts.items()}}
    motion = partial(report_motion, scenario, outcome, folder, data)
    export_outcome(outcome, source.text, out, motion, beside, whole)


def seen_by(out: Path, folder: Path, data: Path | None) -> Callable[[str], str]:
    """How a scenario in `out` names the files of one whose files are sought in the folders."""
    return lambda file: seen_from(resolve_file(file, folder, data), out)


def seen_from(file: Path, folder: Path) -> str:
    """A relative path from the folder to the file; absolute if they share only the root."""
    target, start = file.resolve(), folder.resolve()
    try:
        shared = Path(os.path.commonpath([target, start]))
    except ValueError:  # on different drives
        return target.as_posix()
    if shared == Path(shared.anchor):
        return target.as_posix()
    return Path(os.path.relpath(target, start)).as_posix()
