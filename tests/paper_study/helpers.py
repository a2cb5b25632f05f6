"""Short studies: the same code on recordings of a fraction of a second."""

from __future__ import annotations

from pathlib import Path

from flexgui.core.montecarlo.printed import paper_scenario
from flexgui.core.montecarlo.settings import StudySettings, make_settings
from flexgui.core.resumable.journal import Record
from flexgui.core.scenario.read import write_scenario

FITS = ["fits"]


def short(runs: int = 2, points: int = 3, **settings: object) -> StudySettings:
    """Three working points, 0.5 s, a population that has hardly begun to move."""
    scenario = paper_scenario(points=points, seconds=0.5, population=8, generations=3)
    some = {"sweeps": 1, "baseline_points": (3,), "baseline_snr_db": (20.0,), "bias_seeds": 1}
    return make_settings(scenario, runs=runs, **{**some, **settings})


def scenario_file(folder: Path, settings: StudySettings) -> Path:
    """The scenario of a study as a file."""
    path = folder / "short.toml"
    write_scenario(settings.scenario, path)
    return path


def numbers(records: dict[str, Record]) -> dict[str, object]:
    """What was found, without how long it took."""
    return {key: untimed(record["answer"]) for key, record in records.items()}


def untimed(value: object) -> object:
    """The same without any entry called `seconds`."""
    if isinstance(value, dict):
        return {k: untimed(v) for k, v in value.items() if k != "seconds"}
    return [untimed(v) for v in value] if isinstance(value, list) else value
