"""What prior and search alone make of epsilon and d: no arm, no data, only their product known.

Evolution compares costs and nothing else, and the arm's cost rises with the distance of EI from
the truth; so any cost that does so takes it through the same generations. Where a run ends along
the valley epsilon d^4 = const is then decided by the first population and the search.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from core.arm.slots import STIFFNESS, slot
from core.identify.evolution import evolve
from core.montecarlo.rig import Rig
from core.montecarlo.settings import StudySettings, seeds
from core.montecarlo.study import Answer, Case, Part

VALLEY = ("epsilon", "d")
"""Parameters that only their product EI shows."""

CASES, DRAWS = 10, 20
SEED = 6
"""First number of the seeds."""


class Prior(Part):
    """Some searches of the bare valley."""

    kind = "prior"
    title = "Prior and search alone"
    order = 5

    def cases(self, settings: StudySettings) -> tuple[Case, ...]:
        if set(settings.scenario.identify.parameters) != set(VALLEY):
            return ()
        numbers = range(1, CASES + 1)
        return tuple(Case(self.kind, f"prior/{k:02d}", {"number": k}) for k in numbers)

    def run(self, rig: Rig, options: Mapping[str, Any]) -> Answer:
        number = options["number"]
        ends = [_search(rig, DRAWS * (number - 1) + k) for k in range(DRAWS)]
        names = rig.settings.scenario.identify.parameters
        bounds = {name: list(rig.bounds[name]) for name in names}
        return {"ends": [dict(zip(names, end, strict=True)) for end in ends], "bounds": bounds}


def _search(rig: Rig, draw: int) -> list[float]:
    spec = rig.settings.scenario.identify
    names = list(spec.parameters)
    true = rig.stiffness({})[0]

    def costs(points: np.ndarray) -> np.ndarray:
        EI = rig.model.arm_vectors(names, points)[:, slot(0, STIFFNESS)]
        return np.log(EI / true) ** 2

    low, high = np.array([rig.bounds[n] for n in names]).T
    seed = int(seeds(rig.settings, SEED, draw).generate_state(1)[0])
    found = evolve(costs, low, high, spec.population, spec.generations, seed, lambda _: False)
    return [float(v) for v in found.vector]
