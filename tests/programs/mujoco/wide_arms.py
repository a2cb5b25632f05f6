"""Arms that the wide cases are made with: the paper's, an unequal pair, one segment and three."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.programs.mujoco.chain import Beam, Motor, Plant
from tests.programs.mujoco.excitation import RATE_DECIMALS, SAMPLE

HINGES = 10
"""Per segment. A chain of N hinges is 1 / (4 N²) stiffer or softer than its beam: 0.25 %."""

STEP = 20e-6
"""s. Chains of 10 hinges are stable to 40e-6; `test_wide` halves it."""

AMPLITUDE = 0.4
"""rad/s of the references."""
HOLDS = (10, 20, 40, 80)
"""Samples for which a reference is held: from what shakes the beams to what turns a joint far
enough to see its friction."""
SECONDS = 1.5


@dataclass(frozen=True)
class Arm:
    """Beams, loop gains in N m s/rad, known rotors in kg m², and the postures of its recordings."""

    name: str
    beams: tuple[Beam, ...]
    gains: tuple[float, ...]
    rotors: tuple[float, ...]
    postures: tuple[tuple[float, ...], ...]
    modes: int

    @property
    def joints(self) -> int:
        return len(self.beams)

    @property
    def torques(self) -> np.ndarray:
        """N m, of each loop when a joint at rest meets its reference."""
        return AMPLITUDE * np.array(self.gains)

    @property
    def reach(self) -> float:
        """m"""
        return sum(b.length for b in self.beams)

    @property
    def plant(self) -> Plant:
        motors = (Motor(g, inertia=j) for g, j in zip(self.gains, self.rotors, strict=True))
        return Plant(self.beams, tuple(motors))


def _beams(*each: tuple[float, float, float]) -> tuple[Beam, ...]:
    return tuple(Beam(length, mass, EI, HINGES) for length, mass, EI in each)


ARMS = {
    arm.name: arm
    for arm in (
        Arm(
            "paper",
            _beams((0.5, 7.5, 520.8333), (0.5, 5.0, 520.8333)),
            (60.0, 30.0),
            (0.05, 0.02),
            ((0.0, 0.6), (0.0, 1.4), (0.0, 2.2), (0.0, 1.0)),
            3,
        ),
        Arm(
            "unequal",
            _beams((0.7, 6.0, 900.0), (0.4, 2.5, 150.0)),
            (80.0, 20.0),
            (0.08, 0.01),
            ((0.0, 0.5), (0.0, 1.3), (0.0, 2.1), (0.0, 0.9)),
            3,
        ),
        Arm(
            "one",
            _beams((0.8, 4.0, 200.0)),
            (40.0,),
            (0.05,),
            ((0.0,), (0.5,), (1.0,), (-0.5,)),
            3,
        ),
        Arm(
            "three",
            _beams((0.4, 5.0, 400.0), (0.35, 3.0, 200.0), (0.3, 1.5, 80.0)),
            (60.0, 30.0, 12.0),
            (0.05, 0.02, 0.008),
            ((0.0, 0.6, 0.7), (0.0, 1.4, -0.8), (0.0, -0.7, 1.5), (0.0, 1.0, 0.3)),
            2,
        ),
    )
}


def references(
    arm: Arm, number: int, seconds: float = SECONDS, sample_time: float = SAMPLE
) -> np.ndarray:
    """(samples, joints) in rad/s: each joint's own sequence of holds, each followed by its
    negative, so that no joint wanders."""
    rng = np.random.default_rng([number, *arm.name.encode()])
    samples = round(seconds / sample_time)
    found = np.zeros((samples + 1, arm.joints))
    for k in range(arm.joints):
        at = 0
        while at < samples:
            hold, level = rng.choice(HOLDS), AMPLITUDE * rng.choice((-1.0, 1.0))
            found[at : at + hold, k] = level
            found[at + hold : at + 2 * hold, k] = -level
            at += 2 * hold
    found[-1] = 0.0
    return np.round(found, RATE_DECIMALS)
