"""A project from a file, or from Python objects and tables."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from flexgui.core.arm.arm import Arm
from flexgui.core.drives.drive import Drive
from flexgui.core.errors import InputError
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.save import save_recording
from flexgui.core.scenario.data_folder import resolve_file
from flexgui.core.scenario.read import check_scenario, read_scenario
from flexgui.library.catalogues import OneEffect, model_with
from flexgui.library.comparison import Simulation, with_its_clock
from flexgui.library.project import Project
from flexgui.library.shipped import scenario_path
from flexgui.library.stated_project import SOURCE

if TYPE_CHECKING:
    import pandas as pd

    OneRecording: TypeAlias = (
        "pd.DataFrame | Recording | Simulation | str | Path | Mapping[str, Any]"
    )

TABLE = "table"
"""Key of a recording's settings that holds the table itself."""


def project(
    arm: str | Arm | Mapping[str, Any] = "paper",
    drive: str | Drive | Mapping[str, Any] = "velocity_loop",
    recordings: OneRecording | Iterable[OneRecording] = (),
    *,
    effects: Sequence[OneEffect] = (),
    title: str = "Project",
    folder: str | Path = "",
    data: str | Path | None = None,
    **tables: Any,
) -> Project:
    """Build a project from Python objects and tables.

    Args:
        arm: A preset's name, an `Arm`, or a table as `[arm]` of a scenario.
        drive: An id, a `Drive` such as `drives.VelocityLoop(gains=(60, 30))`, or a table as
            `[drive]`.
        recordings: One or several, each a pandas table (columns as in a file, `theta1 [deg]` or
            SI), a `Recording`, a `Simulation`, a path, or a table as `[[recordings]]`; with the key
            "table" instead of "file" that may hold a pandas table with its role, name and columns.
        effects: As `Project.with_effects` takes them.
        title: Of the report.
        folder: Where relative paths are sought.
        data: Another folder of recordings.
        **tables: Further tables of a scenario: `identify`, `sensors`, `model`, `diagnose`.

    Returns:
        The project.

    Raises:
        InputError: Where a setting is wrong; it says which.
    """
    where = None if data is None else Path(data)
    stated = [_stated(one) for one in _several(recordings)]
    kept = None
    if any(TABLE in one for one in stated):
        kept = tempfile.TemporaryDirectory(prefix="flexgui-")
        stated = [_with_whole_paths(one, Path(folder), where) for one in stated]
        folder = kept.name
    entries = [_entry(one, k, Path(folder)) for k, one in enumerate(stated, start=1)]
    model = model_with(dict(tables.pop("model", {})), effects)
    document = {
        "title": title,
        "arm": _arm_table(arm),
        "drive": _drive_table(drive),
        "recordings": entries,
        **({"model": model} if model else {}),
        **tables,
    }
    made = check_scenario(document, SOURCE)
    found = Project(made, Path(folder), where, kept)
    _ = found.model
    return found


def _several(given: OneRecording | Iterable[OneRecording]) -> list[OneRecording]:
    import pandas as pd

    one = isinstance(given, str | Path | Mapping | Recording | Simulation | pd.DataFrame)
    return [given] if one else list(given)  # type: ignore[arg-type]


def _stated(given: OneRecording) -> dict[str, Any]:
    """What is said of a recording, with its file or the object itself."""
    if isinstance(given, str | Path):
        return {"file": str(given)}
    return dict(given) if isinstance(given, Mapping) else {TABLE: given}


def _with_whole_paths(stated: Mapping[str, Any], folder: Path, data: Path | None) -> dict[str, Any]:
    """Found now: the relative files of a project with tables are sought among the tables."""
    paths = {key: stated[key] for key in ("file", "played") if key in stated}
    return {**stated} | {k: str(resolve_file(p, folder, data).resolve()) for k, p in paths.items()}


def _entry(stated: Mapping[str, Any], number: int, folder: Path) -> dict[str, Any]:
    """One `[[recordings]]` of a scenario; a table that comes as an object becomes a file in
    `folder`, which the loader checks like any other."""
    if TABLE not in stated:
        return dict(stated)
    import pandas as pd

    table, file = stated[TABLE], folder / f"{number}.parquet"
    table = table.recording if isinstance(table, Simulation) else table
    named: dict[str, Any] = {"name": f"recording-{number}"}
    if isinstance(table, Recording):
        save_recording(table, file)
        named = {"name": table.name, "role": table.role}
        named |= {} if table.theta2 is None else {"theta2": table.theta2}
    elif isinstance(table, pd.DataFrame):
        with_its_clock(table).rename(columns=str).to_parquet(file, index=False)
    else:
        raise InputError(
            f"recordings holds {type(table).__name__}; give a pandas table, a Recording, a "
            "Simulation or a path."
        )
    said = {key: value for key, value in stated.items() if key != TABLE}
    return {**named, **said, "file": file.name}


def _arm_table(arm: str | Arm | Mapping[str, Any]) -> dict[str, Any]:
    if isinstance(arm, str):
        return {"preset": arm}
    if isinstance(arm, Arm):
        return arm.model_dump(exclude_none=True)
    return dict(arm)


def _drive_table(drive: str | Drive | Mapping[str, Any]) -> dict[str, Any]:
    if isinstance(drive, str):
        return {"kind": drive}
    if isinstance(drive, Drive):
        return {"kind": drive.kind, **drive.model_dump(exclude_none=True)}
    return dict(drive)


def load(scenario: str | Path, data: str | Path | None = None) -> Project:
    """Read a scenario.

    Args:
        scenario: A TOML file, or the name of one that comes with FlexGUI (`scenarios()`).
        data: Another folder in which the recordings' files are sought.

    Returns:
        The project; its recordings are read when they are needed.

    Raises:
        InputError: Where the file or a setting is wrong.
    """
    path = scenario_path(scenario)
    stated, text = read_scenario(path), path.read_text(encoding="utf-8-sig")
    where = None if data is None else Path(data)
    return Project(stated, path.parent, where, _read=(stated, text))
