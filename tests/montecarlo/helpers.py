"""Short studies: the same code on recordings of a fraction of a second."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from flexgui.core.montecarlo.settings import StudySettings, make_settings
from flexgui.core.resumable.journal import Finished, Record
from flexgui.core.scenario.read import check_scenario, write_scenario
from flexgui.core.scenario.schema import Scenario

FITS = ["fits"]


def paper_scenario(
    points: int = 7, seconds: float = 3.0, population: int = 30, generations: int = 60
) -> Scenario:
    """`points` working points from pi/8 to 7 pi/8, epsilon and d unknown within 20 %."""
    theta2 = np.linspace(np.pi / 8.0, 7.0 * np.pi / 8.0, points)
    recordings = [
        {"simulate": {"theta2": float(p), "seconds": seconds, "seed": k}}
        for k, p in enumerate(theta2, start=1)
    ]
    identify = {
        "parameters": ["epsilon", "d"],
        "output": "ydot",
        "bounds": {"epsilon": [0.8e9, 1.2e9], "d": [0.04, 0.06]},
        "population": population,
        "generations": generations,
    }
    document = {
        "title": "The paper's study",
        "arm": {"preset": "paper"},
        "drive": {"kind": "velocity_loop", "gains": [60.0, 30.0]},
        "model": {"level": "lpv"},
        "recordings": recordings,
        "identify": identify,
    }
    return check_scenario(document, "The paper's scenario")


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


def records_of(steps: Iterable[Finished]) -> dict[str, Record]:
    """key -> record when all is done, in the order in which they came."""
    return {step.record["key"]: step.record for step in steps}
