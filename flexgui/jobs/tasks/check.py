"""Look for faults in a scenario's recordings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from core.check.finding import Finding
    from core.progress import Progress
    from core.scenario.schema import Scenario


def findings(folder: str, scenario: Scenario, *, progress: Progress) -> tuple[Finding, ...]:
    """In the order of the recordings; InputError where one is no table of measurements. Files are
    those of the folder and no others."""
    from core.check.run import check_scenario
    from core.scenario.data_folder import Within

    return tuple(check_scenario(scenario, Within(Path(folder)), None, progress))
