"""`diagnosed.toml`: the scenario with what was found, which runs from where it lies."""

from __future__ import annotations

import os
from pathlib import Path

from core.diagnosed import diagnosed_toml
from core.results import Outcome
from core.scenario.data_folder import resolve_file
from core.scenario.schema import Scenario


def diagnosed_beside(
    scenario: Scenario, outcome: Outcome, out: Path, folder: Path, data: Path | None
) -> str:
    """Its text for the folder `out`; empty without a diagnosis.

    `folder` and `data` are where the scenario's own files are sought.
    """
    if outcome.diagnosis is None:
        return ""

    def locate(file: str) -> str:
        return seen_from(resolve_file(file, folder, data), out)

    return diagnosed_toml(scenario, outcome.diagnosis, locate)


def diagnosed_plainly(scenario: Scenario, outcome: Outcome) -> str:
    """Its text beside copies of the recordings, under the names that the scenario gives them;
    empty without a diagnosis."""
    return "" if outcome.diagnosis is None else diagnosed_toml(scenario, outcome.diagnosis)


def seen_from(file: Path, folder: Path) -> str:
    """A path that finds the file from the folder: relative, so that both may move together,
    unless they share no folder but the root."""
    target, start = file.resolve(), folder.resolve()
    try:
        shared = Path(os.path.commonpath([target, start]))
    except ValueError:  # on different drives
        return target.as_posix()
    if shared == Path(shared.anchor):
        return target.as_posix()
    return Path(os.path.relpath(target, start)).as_posix()
