"""What a worker does before its first job: load the compiled code that most jobs need."""

from __future__ import annotations

TINY = """
title = "Warming up"
[arm]
preset = "paper"
[drive]
kind = "velocity_loop"
gains = [60.0, 30.0]
[[recordings]]
simulate = {theta2 = 1.2, seconds = 0.1, seed = 1}
[identify]
parameters = ["epsilon", "d"]
population = 6
generations = 1
"""


def warm_up() -> None:
    """One tiny identification: a non-linear simulation, linear responses, a refinement."""
    from core.scenario.read import parse_scenario
    from core.workbench import run_scenario

    run_scenario(parse_scenario(TINY, "warm-up"))


def warm_inputs() -> None:
    """Reads nothing yet: the libraries that reading needs, so that the first file is not slow."""
    import pyarrow.csv
    import pyarrow.parquet  # noqa: F401

    import flexgui.stage.recorded  # noqa: F401
