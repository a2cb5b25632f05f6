"""EMPS in free run: what another estimator gains, and what limits all of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import butter, sosfiltfilt

from tests.programs.evidence.emps_rules import (
    DECIMATED,
    ESTIMATED,
    FIRST,
    JUDGED,
    Table,
    inverse_model,
    table,
)
from tests.programs.evidence.frame import table as markdown
from tests.programs.evidence.slide_run import NAMES, fitted_over, free_error

TITLE = "EMPS in free run: estimators, and the limit"
ORDER = 1
FILES = (ESTIMATED, JUDGED)
SOURCES = ("evidence/slide_run.py",)

WINDOWS = (0, 250, 500, 1000, 2000, 4000, 8000, 10**9)
"""Samples (ms) over which the free run is fitted; 0: the inverse model; the last: the whole run."""
SLOW_HZ = 3.0
"""Below: what a double integration makes millimetres of."""
MOVING = 0.02
"""m/s from which a direction counts."""
TIE = 0.3
"""mm: halves that differ by no more distinguish nothing, where one half's error exceeds the other's
by 2 mm and more."""
BINS = 12
"""Of the slide's travel."""


def _values(data: Table, window: int, first: int, last: int) -> np.ndarray:
    part = Table(*(getattr(data, x)[first:last] for x in ("time", "q_ref", "q", "force", "pulse")))
    X, force = inverse_model(part, True)
    start = np.linalg.lstsq(X, force)[0]
    return start if window == 0 else fitted_over(data, window, start, first, last)


def _rms(values: np.ndarray, data: Table, first: int, last: int) -> float:
    return float(np.sqrt(np.mean(free_error(values, data, first, last) ** 2)))


def estimators(folder: Path) -> dict[str, Any]:
    """For each window: what values of one half of the first recording give in the other, and then
    those of the whole first recording on the pulses."""
    data, pulses = (table(folder, name) for name in FILES)
    last, half = len(data.q), len(data.q) // 2
    rows = []
    for window in WINDOWS:
        one, other = (_values(data, window, *x) for x in ((FIRST, half), (half, last)))
        unseen = [_rms(one, data, half, last), _rms(other, data, FIRST, half)]
        whole = _values(data, window, FIRST, last)
        rows.append({
            "window": window,
            "held_out": float(np.sqrt(np.mean(np.square(unseen)))),
            "halves": unseen,
            "first": _rms(whole, data, FIRST, last),
            "pulses": _rms(whole, pulses, FIRST, len(pulses.q)),
            "values": dict(zip(NAMES, whole.tolist(), strict=True)),
        })  # fmt: skip
    return {"rows": rows}


def remainder(folder: Path) -> dict[str, Any]:
    """The force that the structure leaves, on both recordings with the values of the first."""
    first, pulses = (table(folder, name) for name in FILES)
    values = _values(first, 0, FIRST, len(first.q))
    found, own = {}, {}
    for name, data in (("first", first), ("pulses", pulses)):
        X, force = inverse_model(replace(data), True)
        own[name] = np.linalg.lstsq(X, force)[0].tolist()
        low = butter(4, 2.0 * SLOW_HZ * DECIMATED * data.step, output="sos")
        found[name] = sosfiltfilt(low, force - X @ values), X[:, 1], data.q[::DECIMATED]
    same = min(len(each[0]) for each in found.values())
    return {
        "rms": {name: float(np.std(each[0])) for name, each in found.items()},
        "in_time": float(np.corrcoef(*(each[0][:same] for each in found.values()))[0, 1]),
        "over_position": [_over_position(found, way) for way in (1.0, -1.0)],
        "level": {name: _level(*each[:2]) for name, each in found.items()},
        "own": own,
    }


def _level(force: np.ndarray, speed: np.ndarray) -> float:
    """N, mean of what brakes, over both directions: positive where friction is larger."""
    return float(np.mean((np.sign(speed) * force)[np.abs(speed) > MOVING]))


def _over_position(found: Mapping[str, Any], way: float) -> float:
    """Correlation of both recordings' remainders over the slide's position, in one direction."""
    edges = np.linspace(*(f(found["first"][2]) for f in (np.min, np.max)), BINS + 1)
    curves = []
    for force, speed, place in found.values():
        at = np.digitize(place, edges)
        moving = way * speed > MOVING
        curves.append([np.mean(force[moving & (at == k)]) for k in range(1, BINS + 1)])
    return float(np.corrcoef(*curves)[0, 1])


CASES = {"estimators": estimators, "remainder": remainder}


def _estimators(found: Mapping[str, Any]) -> Any:
    from tests.programs.evidence.figures import beside

    rows = found.get("estimators", {}).get("rows")
    if not rows:
        return None
    names = [_window(row["window"]) for row in rows]
    return beside(names, *([row[key] for row in rows] for key in ("held_out", "pulses")))


FIGURES = {"emps_free_run": ("Free run of EMPS, by estimator", _estimators)}


def section(found: Mapping[str, Any]) -> str:
    """Markdown."""
    texts = []
    if "estimators" in found:
        texts += _compared(found["estimators"]["rows"])
    if "remainder" in found:
        texts.append(_limit(found["remainder"]))
    return "\n\n".join(texts)


def _compared(rows: list[dict[str, Any]]) -> list[str]:
    best = min(rows, key=lambda row: row["held_out"])
    cells = [
        [_window(row["window"]), *[f"{mm:.2f}" for mm in row["halves"]], f"{row['held_out']:.2f}",
         f"{row['first']:.2f}", f"{row['pulses']:.2f}"]
        for row in rows
    ]  # fmt: skip
    head = ("estimated from", "first half → second", "second → first", "both, rms",
            "first recording", "pulses, not seen")  # fmt: skip
    about = (
        "The diagnosis finds mass, viscous friction and its asymmetry, and Coulomb friction. This "
        "structure is estimated from the force, or from the position error of free runs over "
        "windows. Only the first recording may choose the length of the window: values of one "
        "half are judged in the other half. All in mm rms."
    )
    near = [row for row in rows if row["held_out"] < best["held_out"] + TIE]
    verdict = (
        f"The least error on halves, {best['held_out']:.2f} mm, comes from "
        f"{_window(best['window'])}: **{best['pulses']:.2f} mm on the pulses**, where the inverse "
        f"model has {rows[0]['pulses']:.2f} mm. But {len(near)} choices are within {TIE:g} mm of "
        f"it on halves. On the pulses these give {min(r['pulses'] for r in near):.2f} to "
        f"{max(r['pulses'] for r in near):.2f} mm. The first recording cannot show which choice is "
        "right. To state the best of them would be to tune on the test data."
    )
    return [about, markdown(head, cells), verdict]


def _window(samples: int) -> str:
    if samples == 0:
        return "the inverse model"
    return "one free run" if samples == WINDOWS[-1] else f"free runs of {samples / 1000:g} s"


def _limit(one: Mapping[str, Any]) -> str:
    own = {name: dict(zip(NAMES, values, strict=True)) for name, values in one["own"].items()}
    moved = one["level"]["pulses"] - one["level"]["first"]
    both = " and ".join(f"{r:.2f}" for r in one["over_position"])
    return (
        f"**What limits it.** With the values of the first recording {one['rms']['first']:.1f} N "
        f"rms remain below {SLOW_HZ:g} Hz there and {one['rms']['pulses']:.1f} N on the pulses. It "
        f"is not noise. The two residuals correlate by {one['in_time']:.2f} in time. Over the "
        f"slide's position they correlate by {both} in the two directions. That looks like "
        f"a force over the place. A smooth one in seven values hardly lowers the error "
        f"of unseen force (own laws, below), and the speed carries more of what is left (real "
        f"rigs, below). The friction differs too: on the pulses "
        f"it is {moved:.2f} N larger (Coulomb {own['first']['fc1']:.2f} and "
        f"{own['pulses']['fc1']:.2f} N, viscous {own['first']['fv1']:.1f} and "
        f"{own['pulses']['fv1']:.1f} N s/m, each from its own recording). One per cent of either "
        "friction is about 3 mm of free run. A model with constant parameters that has not seen "
        "the judged recording cannot predict this change."
    )
