"""Made-up proposals whose words and pictures are looked at."""

from __future__ import annotations

from typing import Any

import numpy as np

from flexgui.core.results import Carrier, Estimate, LawTerm, PlannedExperiment, Proposal
from flexgui.core.results.proposal import ProposedLaw

PLACES = np.linspace(-0.5, 1.5, 9)
STIFFNESS = 12.5
BEGINS = 0.4


def carrier(**other: Any) -> Carrier:
    """What a spring that begins at a place leaves, with one place that nothing was seen of."""
    stated = {
        "target": "joint2", "target_title": "joint 2", "variable": "theta2",
        "title": "position of joint 2", "unit": "rad", "factor": "", "share": 0.97,
        "places": PLACES, "values": STIFFNESS * np.maximum(PLACES - BEGINS, 0.0),
        "deviations": np.array([0.1] * 8 + [np.inf]), "value_unit": "N m",
    }  # fmt: skip
    return Carrier(**{**stated, **other})


FRICTION = carrier(
    target="joint1", target_title="joint 1", variable="u1", title="torque of drive 1", unit="N m",
    factor="times the sign of the speed", share=0.41,
)  # fmt: skip
NEITHER = carrier(title="time since the recording began", variable="t", unit="s", share=-0.2)


def term(of: Carrier) -> LawTerm:
    """The spring itself over the same range."""
    places = np.linspace(PLACES[0], PLACES[-1], 50)
    return LawTerm(of, places, STIFFNESS * np.maximum(places - BEGINS, 0.0))


SIZES = (
    Estimate("a", STIFFNESS, 0.2, "N m/rad", True, lower=-1e4, upper=1e4),
    Estimate("c", BEGINS, 0.004, "rad", True, lower=-0.5, upper=1.5),
)


def law(**other: Any) -> ProposedLaw:
    """The spring, which leaves the noise."""
    stated = {
        "title": "Torque at joint 2 over the position of joint 2, beyond a place",
        "target": "joint2", "formula": "a*max(theta2 - c, 0)",
        "latex": r"\tau_{2} = a \max\left(0, \theta_{2} - c\right)", "parameters": SIZES,
        "terms": (term(carrier()),), "explained": 0.9876, "rms": (18.2, 1.04),
    }  # fmt: skip
    return ProposedLaw(**{**stated, **other})


PLANNED = PlannedExperiment(
    {"theta2": 1.2, "seconds": 3.0, "amplitude": 0.5}, "rad/s", 120.0, ("One law", "Another law")
)


def proposal(*laws: ProposedLaw, **other: Any) -> Proposal:
    """With the laws, and what carries the rest."""
    return Proposal((carrier(), FRICTION, NEITHER), laws, **other)
