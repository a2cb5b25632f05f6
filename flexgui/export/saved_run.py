"""A run that lasts: its scenario and its whole outcome in one file, opened again in any process."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from flexgui.core.errors import InputError
from flexgui.core.results import Outcome
from flexgui.core.scenario.data_folder import Folder
from flexgui.core.scenario.schema import Scenario
from flexgui.core.sentences import listed
from flexgui.export.serialization import deserialize, serialize

FILE = "result.flexgui"


@dataclass(frozen=True)
class Source:
    """What is run: a scenario with the places of its files."""

    scenario: Scenario
    text: str
    """The scenario as a person wrote it, or as TOML."""
    folder: Folder
    """Where its files are; those of a confined folder are taken away with what is exported."""
    data: Path | None = None
    """Another folder of recordings."""
    tables: tuple[Path, ...] = ()
    """Files of tables that came as objects: they are exported too."""


@dataclass(frozen=True)
class SavedRun:
    """What was asked and what was found."""

    scenario: Scenario
    outcome: Outcome
    text: str
    """The scenario's own."""
    folder: str = ""
    """Where the scenario's files are, seen from the folder of the saved run."""
    data: str | None = None
    """The further folder of recordings, seen from there."""
    tables: tuple[str, ...] = ()
    """Names of the files, beside it, of tables that came as objects."""

    def places(self, home: Path) -> tuple[Path, Path | None]:
        """The folders in which the recordings are sought.

        Args:
            home: Folder of the saved run.

        Returns:
            The scenario's folder, or that of the saved run where it is no more, and that of further
            recordings.
        """
        folder = home / self.folder
        further = None if self.data is None else home / self.data
        return folder if folder.is_dir() else home, further

    def source(self, home: Path, data: Path | None = None) -> Source:
        """What was run, with its files where they are now.

        Args:
            home: Folder of the saved run.
            data: Another folder of recordings.

        Raises:
            InputError: Where a table that belongs to it is missing.
        """
        folder, further = self.places(home)
        tables = tuple(home / name for name in self.tables)
        if missing := [path.name for path in tables if not path.is_file()]:
            raise InputError(
                f"{home} lacks {listed(missing)}, which belongs to the result saved there; copy it "
                "back, or save the result again."
            )
        return Source(self.scenario, self.text, folder, data or further, tables)


def run_bytes(run: SavedRun) -> bytes:
    """The content of the file: all but what the tried effects would have done, sample by sample,
    which is drawn while they are tried and would be most of it."""
    found = run.outcome.diagnosis
    if found is None:
        return serialize(run)
    rounds = tuple(
        replace(each, ranking=tuple(replace(r, predicted=()) for r in each.ranking))
        for each in found.rounds
    )
    kept = replace(run.outcome, diagnosis=replace(found, rounds=rounds))
    return serialize(replace(run, outcome=kept))


def read_run(folder: Path) -> SavedRun:
    """Read the run that was saved into a folder.

    Raises:
        InputError: Where there is none, or another version of the program wrote it.
    """
    path = folder / FILE
    try:
        return deserialize(path.read_bytes(), SavedRun)
    except OSError as error:
        raise InputError(
            f"{folder} holds no saved result ({FILE}: {(error.strerror or str(error)).lower()}); "
            "name a folder that save or an export has written."
        ) from None
    except InputError as error:
        raise InputError(f"{path} cannot be opened: {error}") from None
