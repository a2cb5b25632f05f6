"""The paper's scenario, of any length and size."""

from __future__ import annotations

import numpy as np

from core.scenario.read import check_scenario
from core.scenario.schema import Scenario


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
