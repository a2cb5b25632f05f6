"""The cases of the blind matrix: what is hidden, at which size, under which noise."""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from core.effects import catalogue
from core.effects.effect import Effect
from core.recording.spec import SimulateSpec
from core.study.hidden import candidates, parameters_on
from core.study.rig import COLOURS, Experiment, bare_model
from tests.studies.outside import OUTSIDE

POINTS = (np.pi / 8, np.pi / 2, 7 * np.pi / 8)
"""rad, working points theta2 of the three recordings."""

WEAK, STRONG = 0.5, 3.0
"""How much an effect shows: noise rms per sample."""

LEVELS = {"weak": WEAK, "strong": STRONG}

SEEDS, PAIRS, NULLS, OUTSIDERS = 5, 20, 100, 10

SWITCHED = "switched"
"""The size of an effect that has none."""

PARTS = ("singles", "pairs", "nulls", "outside")

EXCITATION: Mapping[str, Mapping[str, Any]] = {}
"""kind -> what its recordings need beyond the default excitation of 1 s."""


@dataclass(frozen=True)
class Case:
    """One blind diagnosis."""

    part: str
    what: tuple[str, ...]
    """Ids of the hidden effects or of a disturbance outside the catalogue; none for a null."""
    level: str
    seed: int
    noise: str

    @property
    def key(self) -> str:
        """By which a finished case is known."""
        what = "+".join(self.what) or "-"
        return "/".join((self.part, what, self.level, str(self.seed), self.noise))

    @property
    def stream(self) -> list[int]:
        """Seeds of everything that is random here but the noise, which both colours share."""
        return [self.seed, zlib.crc32("+".join((self.part, *self.what, self.level)).encode())]

    def experiments(self) -> list[Experiment]:
        """The recordings: each seed has its own references."""
        extra: dict[str, Any] = {}
        for kind in self.what:
            extra |= EXCITATION.get(kind, {})
        given = {"seconds": 1.0, **extra}
        first = 1000 * self.seed + sum(self.stream) % 997
        return [
            Experiment(f"th{k + 1}", SimulateSpec(theta2=float(x), seed=first + k, **given))
            for k, x in enumerate(POINTS)
        ]


def sized(one: Effect) -> bool:
    """Whether the effect has a size at all."""
    return bool(parameters_on(one, bare_model()))


def singles(effects: Sequence[str] = (), count: int = SEEDS) -> list[Case]:
    """Every applicable effect, weak and strong."""
    return [
        Case("singles", (kind,), level, seed, noise)
        for seed in range(1, count + 1)
        for noise in COLOURS
        for kind, one in sorted(candidates().items())
        if not effects or kind in effects
        for level in (LEVELS if sized(one) else (SWITCHED,))
    ]


def pairs(effects: Sequence[str] = (), count: int = PAIRS) -> list[Case]:
    """Strong effects of different rooms, drawn once for all."""
    rng = np.random.default_rng(20)
    able = sorted(k for k, one in candidates().items() if sized(one))
    rooms = {kind: catalogue()[kind].location for kind in able}
    found: list[Case] = []
    while len(found) < count * len(COLOURS):
        a, b = sorted(rng.choice(able, 2, replace=False))
        if rooms[a] != rooms[b] and (a, b) not in {case.what for case in found}:
            seed = 1 + len(found) // len(COLOURS)
            found += [Case("pairs", (str(a), str(b)), "strong", seed, noise) for noise in COLOURS]
    return [case for case in found if not effects or set(effects) & set(case.what)]


def nulls(effects: Sequence[str] = (), count: int = NULLS) -> list[Case]:
    """Nothing is hidden."""
    return [
        Case("nulls", (), "none", seed, noise) for seed in range(1, count + 1) for noise in COLOURS
    ]


def outside(effects: Sequence[str] = (), count: int = OUTSIDERS) -> list[Case]:
    """Something that no effect describes."""
    return [
        Case("outside", (kind,), "strong", seed, noise)
        for seed in range(1, count + 1)
        for noise in COLOURS
        for kind in OUTSIDE
        if not effects or kind in effects
    ]


MAKERS = {
    "singles": (singles, SEEDS),
    "pairs": (pairs, PAIRS),
    "nulls": (nulls, NULLS),
    "outside": (outside, OUTSIDERS),
}
"""part -> its cases, and how many seeds are planned."""


@dataclass(frozen=True)
class Choice:
    """Which cases a person wants to run."""

    parts: tuple[str, ...] = PARTS
    effects: tuple[str, ...] = ()
    seeds: int | None = None
    noises: tuple[str, ...] = tuple(COLOURS)
    levels: tuple[str, ...] = field(default=())

    def cases(self) -> list[Case]:
        """The cases of these parts, levels and noises."""
        found: list[Case] = []
        for part in self.parts:
            make, planned = MAKERS[part]
            found += make(self.effects, planned if self.seeds is None else self.seeds)
        return [
            c
            for c in found
            if c.noise in self.noises and (not self.levels or c.level in self.levels)
        ]
