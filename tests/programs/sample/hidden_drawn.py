"""Drawing of the recordings with laws that no catalogue has, by rule and not by what is found.

Sixteen hide a law: every form once, three forms again on the other arm; half of them on arms that
bend, move in a velocity loop and are seen by a camera, half on a rigid arm with recorded torques.
A law's rms torque is a fifth of the drive's, give or take. In eight there is nothing to be
proposed: noise alone, a camera whose stand vibrates, and bending in more shapes than are stated.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from tests.programs.mujoco.excitation import SAMPLE
from tests.programs.mujoco.hidden_laws import HYSTERESIS, TORQUES, Law, camera_bend, slipped
from tests.programs.mujoco.wide_arms import ARMS
from tests.programs.sample.torque_rigs import SWINGS, TorqueRig

SEED = 2024
CAMERA = "camera_bend"
BENDING = ("paper", "one")

MIDDLES = ((-0.2, 0.9), (0.2, 1.3), (0.0, 1.1), (0.3, 1.5), (0.05, 1.15))
"""rad, about which the joints move; the last recording validates, with smaller moves."""
ROLES = ("estimate",) * 4 + ("validate",)
ESTIMATED = tuple(n for n, role in enumerate(ROLES) if role == "estimate")
REACHES = (0.5,) * 4 + (0.35,)
"""rad"""
SECONDS = 4.0
SLOW = (0.25, 0.45)
"""Hz, of the moves behind a velocity loop: what shakes the beams comes on top."""
RIG = TorqueRig((4.0, 2.5), (0.5, 0.4), rate=1.0 / SAMPLE)
DRIVES = {"paper": (11.8, 4.37), "one": (5.23,), "rigid": (13.9, 3.06)}
"""N m, rms of the drives' torques in the estimation recordings with nothing hidden."""
SHARES = (0.15, 0.25)
"""Of the drive's rms torque, least and most that of a law on the intended motion."""
BENT = (1e-3, 3e-3)
"""m, rms by which a camera's reading is bent: 30 to 100 times its noise."""
STANDS = 3
STAND_HZ, STAND_SIZES = (7.0, 23.0), (2e-4, 6e-4)
"""Hz and m, of a camera's stand that vibrates."""
NEED_TWO = ("other_joint", "quadratic_friction")
"""Forms for two joints. Quadratic friction of a single one is drag at its tip, which is in the
catalogue."""


@dataclass(frozen=True)
class Case:
    """One set of recordings; without law and camera's law there is nothing to be proposed."""

    name: str
    arm: str
    """rigid, or one of the wide arms."""
    law: Law | None = None
    camera: Mapping[str, float] = field(default_factory=dict)
    """The axis of a reading that is bent (0 or 1), and what `camera_bend` takes."""
    stand: Mapping[str, float] = field(default_factory=dict)
    """hz, size in m, direction in rad, and decay in 1/s of a vibration of the camera."""
    modes: int = 0
    """Stated of each segment; none: enough."""

    @property
    def joints(self) -> int:
        return RIG.joints if self.arm == "rigid" else ARMS[self.arm].joints


def intended(arm: str, number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times in s (N,), and the way (N, joints) in rad and its rate that a recording is meant to
    have; joints begin at rest."""
    joints = Case("", arm).joints
    rng = np.random.default_rng([SEED, number, *arm.encode()])
    t = SAMPLE * np.arange(round(SECONDS / SAMPLE) + 1)
    hz = np.array(SWINGS[:4] if arm == "rigid" else SLOW)
    phases = rng.uniform(0.0, 2.0 * np.pi, (joints, len(hz)))
    waves = np.sin(2.0 * np.pi * hz * t[:, None, None] + phases) / (1.0 + hz)
    begin = np.clip(t / 0.5, 0.0, 1.0)[:, None]
    way = begin**3 * (10.0 - 15.0 * begin + 6.0 * begin**2) * waves.sum(axis=2)
    way *= REACHES[number] / np.abs(way).max(axis=0)
    way += np.array(MIDDLES[number][:joints])
    return t, way, np.gradient(way, SAMPLE, axis=0)


def _ranges(arm: str) -> np.ndarray:
    """(2, joints) rad: least and largest intended angle that is estimated with."""
    ways = np.concatenate([intended(arm, n)[1] for n in ESTIMATED])
    return np.array([ways.min(axis=0), ways.max(axis=0)])


def _numbers(form: str, low: float, high: float, rng: np.random.Generator) -> dict[str, float]:
    """All but the size, for a carrier that moves between two angles in rad."""
    span = high - low

    def at(first: float, last: float) -> float:
        return low + span * rng.uniform(first, last)

    side = float(rng.choice((-1.0, 1.0)))
    start = at(0.5, 0.7) if side > 0 else at(0.3, 0.5)
    middle, turn = at(0.4, 0.6), rng.uniform(0.0, 2.0 * np.pi)
    found = {
        "range_friction": {"low": at(0.1, 0.35), "high": at(0.6, 0.8), "edge": 0.03},
        "cogging": {
            "order": float(rng.integers(12, 25)), "second": rng.uniform(0.5, 0.8),
            "third": rng.uniform(0.3, 0.6), "start": turn,
        },
        "other_joint": {"middle": at(0.25, 0.75), "width": span * rng.uniform(0.15, 0.25)},
        "dead_zone_spring": {"middle": middle, "half": span * rng.uniform(0.12, 0.22)},
        "settling_friction": {"tau": rng.uniform(0.5, 1.5)},
        "cable": {"start": start, "side": side},
        HYSTERESIS: {"way": rng.uniform(0.05, 0.3), "power": float(rng.choice((0.0, 2.0)))},
        "place_viscous": {"middle": middle, "width": span * rng.uniform(0.15, 0.3)},
        "exponential_spring": {
            "start": start, "width": span * rng.uniform(0.12, 0.22), "side": side,
        },
        "directed_friction": {
            "order": rng.uniform(3.0, 7.0), "start": turn, "depth": rng.uniform(0.6, 0.9),
            "back": rng.uniform(0.2, 0.5),
        },
    }  # fmt: skip
    return {name: float(f"{x:.4g}") for name, x in found.get(form, {}).items()}


def _sized(law: Law, arm: str, rng: np.random.Generator) -> Law:
    """With the size that is its share of the drive's torque on the intended motion."""
    one = replace(law, numbers={"size": 1.0, **law.numbers})
    torques = []
    for number in ESTIMATED:
        t, way, rate = intended(arm, number)
        if law.form == HYSTERESIS:
            shares, share = [], 0.0
            for v in rate[:, law.target]:
                shares.append(share)
                share = slipped(share, v, SAMPLE, law.numbers["way"], law.numbers["power"])
            torques.append(one.torque(way, rate, t, np.array(shares)))
        else:
            torques.append(one.torque(way, rate, t))
    rms = float(np.sqrt(np.mean(np.square(np.concatenate(torques)))))
    size = rng.uniform(*SHARES) * DRIVES[arm][law.target] / rms
    return replace(law, numbers={**one.numbers, "size": float(f"{size:.4g}")})


def _law_case(form: str, arm: str, target: int, rng: np.random.Generator) -> Case:
    carrier = 1 - target if form == "other_joint" else target
    low, high = _ranges(arm)[:, carrier]
    law = _sized(Law(form, target, carrier, _numbers(form, low, high, rng)), arm, rng)
    return Case(f"{form}_{arm}_joint{target + 1}", arm, law)


def _camera_case(arm: str, rng: np.random.Generator) -> Case:
    """A reading of one axis that is bent, by so much on the intended motion of a rigid arm."""
    axis, power = int(rng.integers(2)), float(rng.choice((2.0, 3.0)))
    lengths, reach = [b.length for b in ARMS[arm].beams], ARMS[arm].reach
    ways = np.concatenate([intended(arm, n)[1] for n in ESTIMATED])
    seen = (np.cos, np.sin)[axis](np.cumsum(ways, axis=1)) @ np.array(lengths)
    rms = float(np.sqrt(np.mean(camera_bend(seen, 1.0, reach, power) ** 2)))
    size = float(f"{rng.uniform(*BENT) / rms:.4g}")
    bend = {"axis": axis, "size": size, "length": reach, "power": power}
    return Case(f"{CAMERA}_{arm}_z{axis + 1}", arm, camera=bend)


def _with_laws(rng: np.random.Generator) -> Iterator[Case]:
    """Six forms and a camera's on arms that bend, six on the rigid arm; then one and two of them
    on the other arm and, where that has two, at the other joint."""
    order = [str(form) for form in rng.permutation(list(TORQUES))]
    bending, rigid = order[:6], order[6:]
    targets = dict[str, int]()

    def bent(form: str, target: int) -> Case:
        arm = "paper" if form in NEED_TWO or target else str(rng.choice(BENDING))
        return _law_case(form, arm, target, rng)

    for form in order:
        targets[form] = int(rng.integers(2))
    yield from (bent(form, targets[form]) for form in bending)
    yield _camera_case(str(rng.choice(BENDING)), rng)
    yield from (_law_case(form, "rigid", targets[form], rng) for form in rigid)
    for form in rng.choice(rigid, 1):
        yield bent(str(form), 1 - targets[form])
    for form in rng.choice(bending, 2, replace=False):
        yield _law_case(str(form), "rigid", 1 - targets[form], rng)


def _stand(rng: np.random.Generator, third: int, decay: float) -> dict[str, float]:
    """In its third of the frequencies, so that all are not alike; `decay` in 1/s."""
    ends = np.linspace(*STAND_HZ, STANDS + 1)
    values = {
        "hz": rng.uniform(ends[third], ends[third + 1]), "size": rng.uniform(*STAND_SIZES),
        "direction": rng.uniform(0.0, np.pi), "decay": decay,
    }  # fmt: skip
    return {name: float(f"{x:.4g}") for name, x in values.items()}


def cases() -> dict[str, Case]:
    """All twenty-four by name."""
    rng = np.random.default_rng(SEED)
    found = list(_with_laws(rng))
    found += [Case(f"nothing_noise_{arm}", arm) for arm in (*BENDING, "rigid")]
    for n, third in enumerate(rng.permutation(STANDS)):
        arm, decay = (("paper", 0.0), ("one", 0.0), ("paper", 1.0))[n]
        found.append(Case(f"nothing_stand{n + 1}_{arm}", arm, stand=_stand(rng, third, decay)))
    found += [Case(f"nothing_shape_{arm}", arm, modes=1) for arm in BENDING]
    return {case.name: case for case in found}
