"""A project from Python objects and tables."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from flexgui.core.arm.arm import Arm
from flexgui.core.drives.drive import Drive
from flexgui.core.errors import InputError
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.save import save_recording
from flexgui.core.scenario.read import check_scenario
from flexgui.library.catalogues import OneEffect, model_with
from flexgui.library.project import SOURCE, Project

if TYPE_CHECKING:
    import pandas as pd

    OneRecording: TypeAlias = "pd.DataFrame | Recording | str | Path | Mapping[str, Any]"

TABLE = "table"
"""Key of a recording's settings that holds the table itself."""


def project(
    arm: str | Arm | Mapping[str, Any] = "paper",
    drive: str | Drive | Mapping[str, Any] = "velocity_loop",
    recordings: Sequence[OneRecording] = (),
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
        recordings: Each a pandas table (columns as in a file, `theta1 [deg]` or SI), a
            `Recording`, a path, or a table as `[[recordings]]`; with the key "table" instead of
            "file" that may hold a pandas table with its role, name and columns.
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
    store = _Store()
    entries = [store.entry(one, k) for k, one in enumerate(recordings, start=1)]
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
    if store.kept is not None and str(folder):
        raise InputError(
            "recordings mixes tables with a folder of files; read the files with pandas first, or "
            "give their whole paths."
        )
    where = Path(folder) if store.kept is None else Path(store.kept.name)
    found = Project(made, where, None if data is None else Path(data), store.kept)
    _ = found.model
    return found


class _Store:
    """Tables that come as objects, as files that the loader checks like any other."""

    def __init__(self) -> None:
        self.kept: tempfile.TemporaryDirectory[str] | None = None

    def entry(self, given: OneRecording, number: int) -> dict[str, Any]:
        """One `[[recordings]]` of a scenario."""
        if isinstance(given, str | Path):
            return {"file": str(given)}
        if isinstance(given, Recording):
            self._put(given, f"{number}.parquet")
            named = {"name": given.name, "role": given.role, "file": f"{number}.parquet"}
            return named if given.theta2 is None else {**named, "theta2": given.theta2}
        if isinstance(given, Mapping):
            return self._stated(dict(given), number)
        return self._stated({TABLE: given}, number)

    def _stated(self, entry: dict[str, Any], number: int) -> dict[str, Any]:
        if TABLE not in entry:
            return entry
        table = entry.pop(TABLE)
        if isinstance(table, Recording):
            return {**self.entry(table, number), **entry}
        self._put(table, f"{number}.parquet")
        return {"name": f"recording-{number}", **entry, "file": f"{number}.parquet"}

    def _put(self, table: Recording | pd.DataFrame, name: str) -> None:
        import pandas as pd

        if self.kept is None:
            self.kept = tempfile.TemporaryDirectory(prefix="flexgui-")
        path = Path(self.kept.name) / name
        if isinstance(table, Recording):
            save_recording(table, path)
        elif isinstance(table, pd.DataFrame):
            frame = table if table.index.name is None else table.reset_index()
            frame.rename(columns=str).to_parquet(path, index=False)
        else:
            raise InputError(
                f"recordings holds {type(table).__name__}; give a pandas table, a Recording or a "
                f"path."
            )


def _arm_table(arm: str | Arm | Mapping[str, Any]) -> dict[str, Any]:
    if isinstance(arm, str):
        return {"preset": arm}
    if isinstance(arm, Arm):
        segments = [segment.model_dump(exclude_none=True) for segment in arm.segments]
        return {"name": arm.name, "gravity": arm.gravity, "segments": segments}
    return dict(arm)


def _drive_table(drive: str | Drive | Mapping[str, Any]) -> dict[str, Any]:
    if isinstance(drive, str):
        return {"kind": drive}
    if isinstance(drive, Drive):
        return {"kind": drive.kind, **drive.model_dump(exclude_none=True)}
    return dict(drive)
