"""Where a bias in EI comes from: how far theta2 wanders, and at which angles J is taken.

Noise-free local fits of EI alone, so that nothing but the linear model's own error is left.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ...montecarlo.parts.fits import fit
from ...montecarlo.rig import Rig, outputs, with_outputs
from ...montecarlo.settings import StudySettings
from ...montecarlo.study import Answer, Case, Part
from ...recording.recording import Recording
from ...recording.velocity import central_difference
from ...scenario.schema import IdentifySpec
from ...sensors.rigid_rates import lengths, rigid_rates

EXCITATIONS = ("prbs_balanced", "prbs")
BIAS_SEED = 3001
"""Of the excitation: seed + 1000 draw + point."""

REFINED = IdentifySpec(parameters=("EI",), output=("ydot",), generations=0)
"""One parameter and no noise: a descent from the truth finds the nearest and only minimum."""


class Bias(Part):
    """One draw of the excitation at every working point."""

    kind = "bias"
    title = "Sources of bias"
    order = 4

    def cases(self, settings: StudySettings) -> tuple[Case, ...]:
        numbers = range(1, settings.bias_seeds + 1)
        return tuple(Case(self.kind, f"bias/{k:03d}", {"draw": k}) for k in numbers)

    def run(self, rig: Rig, options: Mapping[str, Any]) -> Answer:
        sources = []
        for excitation in EXCITATIONS:
            points = range(len(rig.settings.experiments))
            recordings = [self._recording(rig, excitation, options["draw"], k) for k in points]
            for name, rates in RATES.items():
                data = [with_outputs(r, rates(rig, r)) for r in recordings]
                sources.append(
                    {
                        "excitation": excitation,
                        "rates": name,
                        "local": [_relative_bias(rig, [r]) for r in data],
                        "glocal": _relative_bias(rig, data),
                        "wander": [float(np.ptp(r["theta2"])) for r in data],
                    }
                )
        return {"draw": options["draw"], "sources": sources}

    def _recording(self, rig: Rig, excitation: str, draw: int, k: int) -> Recording:
        like = rig.settings.experiments[k].simulate
        assert like is not None
        update = {"excitation": excitation, "seed": BIAS_SEED + 1000 * draw + k, "options": {}}
        return rig.recording(like.model_copy(update=update), f"bias {excitation} {k}")


def _relative_bias(rig: Rig, recordings: list[Recording]) -> float:
    """(EI found - EI true) / EI true."""
    true = rig.stiffness({})[0]
    return fit(rig, "bias", recordings, REFINED).fit.estimates[0].value / true - 1.0


def _own(rig: Rig, r: Recording) -> np.ndarray:
    return outputs(r)


def _at_encoders(rig: Rig, r: Recording) -> np.ndarray:
    return _rates(rig, r, np.column_stack([r["theta1"], r["theta2"]]))


def _at_working_point(rig: Rig, r: Recording) -> np.ndarray:
    return _rates(rig, r, np.tile([0.0, float(r.theta2 or 0.0)], (len(r.time), 1)))


def _rates(rig: Rig, r: Recording, angles: np.ndarray) -> np.ndarray:
    """J(angles)^-1 z' with z' by central differences of the sampled tip."""
    speed = np.column_stack([central_difference(r[z], r.sample_time) for z in ("z1", "z2")])
    return rigid_rates(angles, speed, *lengths(rig.model.numbers().p))


RATES: dict[str, Callable[[Rig, Recording], np.ndarray]] = {
    "tip": _own,
    "encoders": _at_encoders,
    "working point": _at_working_point,
}
"""At which angles J is taken: the rigid arm's own, the encoders' (12), the working point's (8)."""
