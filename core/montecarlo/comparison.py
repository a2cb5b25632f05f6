"""The results of a study beside each other: methods, validation sweeps, sources of a bias."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from core.resumable.journal import Record
from core.written import format_number

GLOCAL = "glocal"
KINDS = ("identified", "unseen", "sweeps")

EQUAL = 0.05
"""% of FIT: a difference below this is none."""

EQUAL_SHARE = 0.02
"""Of a pole error or a time: likewise."""


@dataclass(frozen=True)
class BaselineRow:
    """One method on one set of data."""

    snr_db: float | None
    points: int
    method: str
    fit: Mapping[str, float]
    """% at identified and unseen working points and on sweeps, mean over recordings and outputs."""
    pole_error: float
    """Mean relative distance of the poles over theta2."""
    pole_errors: np.ndarray
    """Over the range of theta2."""
    parameters: int
    seconds: float
    sentence: str
    """What the row's figures say."""
    note: str


def baseline_rows(records: Mapping[str, Record]) -> tuple[BaselineRow, ...]:
    """By number of points, then ratio in the order of the cases, then method."""
    found: list[BaselineRow] = []
    for record in records.values():
        if record["part"] == "baselines":
            answer = record["answer"]
            for entry in answer["methods"]:
                found.append(_row(answer, entry))
    return tuple(found)


def _row(answer: Mapping[str, Any], entry: Mapping[str, Any]) -> BaselineRow:
    others = [m for m in answer["methods"] if m["method"] != entry["method"]]
    return BaselineRow(
        snr_db=answer["snr_db"],
        points=answer["points"],
        method=entry["method"],
        fit=dict(entry["fit"]),
        pole_error=entry["pole_error"],
        pole_errors=np.array(entry["pole_errors"]),
        parameters=entry["parameters"],
        seconds=entry["seconds"],
        sentence=_sentence(entry, others),
        note=_note(entry["about"]),
    )


def _note(about: Mapping[str, Any]) -> str:
    if "order" in about:
        return f"order {about['order']}, degree {about['degree']} in cos θ₂"
    return "EI " + ", ".join(f"{EI:.2f}" for EI in about["EI"]) + " N m²"


def _sentence(entry: Mapping[str, Any], others: Sequence[Mapping[str, Any]]) -> str:
    """Beside glocal; for glocal itself beside the best of the others."""
    if entry["method"] == GLOCAL:
        return _of_glocal(entry, others)
    glocal = next((m for m in others if m["method"] == GLOCAL), None)
    if glocal is None:
        return ""
    ahead: list[str] = []
    behind: list[str] = []
    for kind, words in zip(
        KINDS, ("at its own points", "at unseen points", "on sweeps"), strict=True
    ):
        gain = entry["fit"][kind] - glocal["fit"][kind]
        if abs(gain) > EQUAL:
            (ahead if gain > 0 else behind).append(f"{abs(gain):.2f} points of FIT {words}")
    poles = entry["pole_error"], glocal["pole_error"]
    if abs(poles[0] - poles[1]) > EQUAL_SHARE * max(poles):
        times = max(poles) / max(min(poles), 1e-300)
        worse = poles[0] > poles[1]
        (behind if worse else ahead).append(
            f"poles {format_number(times, 3)} times {'as wrong' if worse else 'as near'}"
        )
    return f"{_verdict(ahead, behind)} {_effort(entry, glocal)}"


def _verdict(ahead: Sequence[str], behind: Sequence[str]) -> str:
    if not ahead and not behind:
        return "As good as glocal."
    if not behind:
        return f"Better than glocal: {', '.join(ahead)}."
    if not ahead:
        return f"Worse than glocal: {', '.join(behind)}."
    return f"Better than glocal in {', '.join(ahead)}; worse in {', '.join(behind)}."


def _effort(entry: Mapping[str, Any], glocal: Mapping[str, Any]) -> str:
    times = entry["seconds"] / glocal["seconds"]
    time = f"{times:.1f} times the time" if times >= 1.0 else f"{1.0 / times:.1f} times as fast"
    if entry["parameters"] == glocal["parameters"]:
        return f"As many parameters, {time}."
    return f"{entry['parameters']} numbers instead of {glocal['parameters']}, {time}."


def _of_glocal(entry: Mapping[str, Any], others: Sequence[Mapping[str, Any]]) -> str:
    won, lost = [], []
    for kind, words in zip(KINDS, ("its own points", "unseen points", "sweeps"), strict=True):
        best = max(others, key=lambda m: m["fit"][kind])
        gain = entry["fit"][kind] - best["fit"][kind]
        if gain < -EQUAL:
            lost.append(f"{words} ({best['method']}, by {-gain:.2f} points)")
        elif gain > EQUAL:
            won.append(f"{words} (by {gain:.2f} points)")
    nearest = min(others, key=lambda m: m["pole_error"])
    if entry["pole_error"] < (1.0 - EQUAL_SHARE) * nearest["pole_error"]:
        won.append("poles")
    elif entry["pole_error"] > (1.0 + EQUAL_SHARE) * nearest["pole_error"]:
        times = entry["pole_error"] / max(nearest["pole_error"], 1e-300)
        lost.append(f"poles ({nearest['method']}, {format_number(times, 3)} times as near)")
    first = f"Best on {', '.join(won)}." if won else "Best on nothing alone."
    return f"{first} Beaten on {', '.join(lost)}." if lost else f"{first} Beaten on nothing."


LEVELS = {"lpv": "LPV", "rigid": "rigid arm", "nonlinear": "non-linear"}
"""level -> how it is called."""


@dataclass(frozen=True)
class Validation:
    """The sweeps of a study; fits[level] is (sweeps, 2) in %."""

    sweeps: tuple[int, ...]
    snr_db: float | None
    """Of the data that the estimates come from; the sweeps themselves have no noise."""
    fits: Mapping[str, np.ndarray]
    time: np.ndarray
    """s, of the first sweep's path."""
    theta2: np.ndarray
    """rad"""

    def mean(self, level: str) -> tuple[float, float]:
        """Average FIT of both velocities."""
        first, second = self.fits[level].mean(axis=0)
        return float(first), float(second)


def validation(records: Mapping[str, Record]) -> Validation | None:
    """None where no sweep is finished."""
    answers = [r["answer"] for key, r in sorted(records.items()) if r["part"] == "sweeps"]
    if not answers:
        return None
    return Validation(
        tuple(a["sweep"] for a in answers),
        answers[0]["snr_db"],
        {level: np.array([a["fit"][level] for a in answers]) for level in LEVELS},
        np.array(answers[0]["time"]),
        np.array(answers[0]["theta2"]),
    )


@dataclass(frozen=True)
class BiasSource:
    """Relative bias of EI without noise, for one excitation and one way to take J."""

    excitation: str
    rates: str
    """'tip', 'encoders' or 'working point': at which angles J is taken."""
    local: np.ndarray
    """(draws, points)"""
    glocal: np.ndarray
    """(draws,)"""
    wander: np.ndarray
    """(draws, points) rad: the range of theta2 in each experiment."""

    @property
    def rms(self) -> np.ndarray:
        """(points,)"""
        return np.sqrt(np.mean(self.local**2, axis=0))

    @property
    def glocal_rms(self) -> float:
        """Root mean square of the glocal estimates' bias."""
        return float(np.sqrt(np.mean(self.glocal**2)))


def bias_sources(records: Mapping[str, Record]) -> tuple[BiasSource, ...]:
    """In the order in which they were computed; empty where none is finished."""
    answers = [r["answer"] for key, r in sorted(records.items()) if r["part"] == "bias"]
    if not answers:
        return ()
    found = []
    for k, first in enumerate(answers[0]["sources"]):
        each = [a["sources"][k] for a in answers]
        found.append(
            BiasSource(
                first["excitation"],
                first["rates"],
                np.array([s["local"] for s in each]),
                np.array([s["glocal"] for s in each]),
                np.array([s["wander"] for s in each]),
            )
        )
    return tuple(found)
