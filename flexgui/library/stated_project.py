"""What a project consists of: a scenario and the places of its recordings."""

from __future__ import annotations

import shutil
import tempfile
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from flexgui.core.model import Model
from flexgui.core.scenario.read import check_scenario, scenario_toml, write_scenario
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.library.catalogues import OneEffect, model_with
from flexgui.views.table import Column, Row, Table, html_table

if TYPE_CHECKING:
    from flexgui.core.results import Outcome

SOURCE = "The project"


def folder_of_tables(content: Mapping[str, bytes]) -> tempfile.TemporaryDirectory[str]:
    """A folder for tables that came as objects, name -> content; it goes with the projects."""
    folder: tempfile.TemporaryDirectory[str] = tempfile.TemporaryDirectory(prefix="flexgui-")
    for name, each in content.items():
        Path(folder.name, name).write_bytes(each)
    return folder


@dataclass(frozen=True, repr=False)
class StatedProject:
    """A scenario with the places of its recordings. Frozen: each change is a new project."""

    scenario: Scenario
    folder: Path = Path()
    """Where relative files of the recordings are sought."""
    data: Path | None = None
    """Another folder of recordings."""
    _kept: tempfile.TemporaryDirectory[str] | None = field(default=None, compare=False)
    """Tables that came as objects; removed with the last project that needs them."""
    _read: tuple[Scenario, str] | None = field(default=None, compare=False)
    """The scenario as it was read, with its text as a person wrote it."""

    @property
    def title(self) -> str:
        """The scenario's title."""
        return self.scenario.title

    @property
    def model(self) -> Model:
        """The model as stated, before any fit."""
        return base_model(self.scenario)

    @property
    def _places(self) -> dict[str, Any]:
        """Where the files are sought."""
        return {"folder": self.folder, "data_folder": self.data}

    def with_settings(self, **tables: Any) -> Self:
        """Change settings of the scenario.

        Args:
            **tables: A scenario's tables as keywords, `identify={"generations": 0}`. Keys of a
                table that are not named stay; lists are replaced whole; None removes a table.

        Returns:
            A new project.

        Raises:
            InputError: Where a key or a value is wrong.
        """
        document = self.scenario.model_dump(exclude_unset=True)
        for name, table in tables.items():
            if table is None:
                document.pop(name, None)
            elif isinstance(table, Mapping) and isinstance(document.get(name), dict):
                document[name] = {**document[name], **table}
            else:
                document[name] = table
        return replace(self, scenario=check_scenario(document, SOURCE))

    def with_effects(self, *effects: OneEffect) -> Self:
        """Put effects into the model, beside those that it has.

        Args:
            *effects: Each an id, a class, an instance, a table {"id": ..., "fc1": 1.0}, or a
                `formula`. A class that FlexGUI does not know is registered.

        Returns:
            A new project.

        Raises:
            InputError: Where an effect is not known or a parameter is wrong.
        """
        model = self.scenario.model_dump(exclude_unset=True).get("model", {})
        found = self.with_settings(model=model_with(model, effects))
        _ = found.model  # what is wrong is said now
        return found

    def to_toml(self) -> str:
        """Write the scenario as TOML text: as it was read where nothing has changed since."""
        if self._read is not None and self._read[0] is self.scenario:
            return self._read[1]
        return scenario_toml(self.scenario)

    def save(self, path: str | Path) -> Path:
        """Write the scenario as a file, and beside it the tables that came as objects.

        Args:
            path: Of the TOML file; its folder is made where it is missing.

        Returns:
            Its path.
        """
        target = Path(path)
        target.parent.mkdir(parents=True, exist_ok=True)
        for table in () if self._kept is None else Path(self._kept.name).iterdir():
            shutil.copyfile(table, target.parent / table.name)
        write_scenario(self.scenario, target)
        return target

    def _write(self, outcome: Outcome, out: Path, whole: bool = True) -> None:
        """An export of what was computed before, or the result alone."""
        from flexgui.export.export_files import export_run
        from flexgui.export.saved_run import Source

        tables = () if self._kept is None else tuple(Path(self._kept.name).iterdir())
        source = Source(self.scenario, self.to_toml(), self.folder, self.data, tables)
        export_run(outcome, source, out, whole)

    def __getstate__(self) -> dict[str, Any]:
        """With the tables themselves, since another process has no such folder."""
        kept = None if self._kept is None else Path(self._kept.name)
        tables = None if kept is None else {p.name: p.read_bytes() for p in kept.iterdir()}
        return {**self.__dict__, "_kept": tables}

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        self.__dict__.update(state)
        if state["_kept"] is not None:
            kept = folder_of_tables(state["_kept"])
            self.__dict__.update(_kept=kept, folder=Path(kept.name))

    def _settings(self) -> dict[str, str]:
        """What it consists of, a line each."""
        s = self.scenario
        arm = s.arm.name or s.arm.preset or f"{len(s.arm.segments)} segments"
        roles = Counter(r.role for r in s.recordings)
        return {
            "Project": s.title,
            "Rig": f"{arm}, {s.drive.kind}",
            "Model": ", ".join((s.model.level, *(e.id for e in s.model.effects))),
            "Recordings": ", ".join(f"{n} to {role}" for role, n in roles.items()) or "none",
            "Estimated": ", ".join(s.identify.parameters) or "none",
        }

    def __repr__(self) -> str:
        return "\n".join(f"{name}: {value}" for name, value in self._settings().items())

    def _repr_html_(self) -> str:
        rows = tuple(Row(row) for row in self._settings().items())
        return str(html_table(Table((Column("Setting"), Column("Value")), rows)))
