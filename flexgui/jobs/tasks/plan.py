"""The next experiments, as files to play in a folder."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from core.progress import Progress


def plan_next(
    scenario_toml: str, seconds: float, folder: str, out: str, *, progress: Progress
) -> tuple[str, ...]:
    """What the plan says; its files lie in `out`. `folder` holds the files that the scenario, with
    the limits in it, may read: they are to lie beside those of the plan, under their names.
    """
    from core.experiments.design import Wish
    from core.experiments.plan import plan
    from core.experiments.words import words
    from core.scenario.data_folder import Within
    from core.scenario.read import parse_scenario
    from flexgui.export.planned import write_plan

    scenario = parse_scenario(scenario_toml, "The scenario")
    wish = Wish(seconds, limits=scenario.limits)
    found = plan(scenario, wish, folder=Within(Path(folder)), progress=progress)
    write_plan(scenario, found, Path(out))
    return words(found)
