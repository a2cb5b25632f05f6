"""Subspace models of nfoursid per working point, with outputs interpolated, beside the glocal fit
and the program's own subspace models."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pandas as pd

from flexgui.core.montecarlo.interpolated import StateSpace, identify_subspace
from flexgui.core.montecarlo.parts import baselines
from flexgui.core.montecarlo.parts.baselines import Baselines, Contender, pole_error, references
from flexgui.core.montecarlo.rig import Rig, outputs
from flexgui.core.montecarlo.settings import make_settings
from flexgui.core.recording.recording import Recording
from flexgui.core.scenario.read import read_scenario
from tests.programs.evidence.frame import Summary, better, table

TITLE = "Peers on equal data: subspace models"
ORDER = 3
FILES: tuple[str, ...] = ()
NEEDS = ("nfoursid",)

SCENARIO = Path(__file__).resolve().parents[4] / "scenarios" / "paper_glocal.toml"
BLOCK_ROWS = (15, 30, 60)
"""Tried for both; the one with the least error on its own data is kept."""
ORDERS = (4, 6, 8)
SNR_DB = 20.0
POINTS = 7

Identified = Callable[[np.ndarray, np.ndarray, Sequence[int]], StateSpace]
"""One model from u (N, nu) and y (N, ny), of the best of these orders."""


def by_nfoursid(u: np.ndarray, y: np.ndarray, orders: Sequence[int] = ORDERS) -> StateSpace:
    """As its documentation shows it; its D, which the arm has not, is left out."""
    from nfoursid.nfoursid import NFourSID

    names = [f"u{k}" for k in range(u.shape[1])], [f"y{k}" for k in range(y.shape[1])]
    data = pd.DataFrame(np.hstack([u, y]), columns=[*names[0], *names[1]])
    found = []
    for rows in BLOCK_ROWS:
        one = NFourSID(data, output_columns=names[1], input_columns=names[0], num_block_rows=rows)
        one.subspace_identification()
        for order in orders:
            model, _ = one.system_identification(rank=order)
            found.append(StateSpace(model.a, model.b, model.c))
    return _nearest(found, u, y)


def by_ours(u: np.ndarray, y: np.ndarray, orders: Sequence[int] = ORDERS) -> StateSpace:
    """PO-MOESP with B by least squares on the outputs."""
    return _nearest(identify_subspace(u, y, orders), u, y)


def _nearest(models: Sequence[StateSpace], u: np.ndarray, y: np.ndarray) -> StateSpace:
    errors = [np.nan_to_num(np.sum((m.respond(u) - y) ** 2), nan=np.inf) for m in models]
    return models[int(np.argmin(errors))]


IDENTIFIED = {"nfoursid": by_nfoursid, "own subspace models": by_ours}


@dataclass
class Blended(Contender):
    """Local models side by side: each responds, and the outputs are interpolated over theta2."""

    models: Sequence[StateSpace]
    places: np.ndarray
    sample_time: float
    parameters: int = field(init=False)

    def __post_init__(self) -> None:
        self.parameters = sum(m.A.size + m.B.size + m.C.size for m in self.models)

    def predict(self, recording: Recording) -> np.ndarray:
        all_outputs = [m.respond(references(recording)) for m in self.models]
        still = recording.theta2 is not None
        theta2 = np.full(len(all_outputs[0]), recording.theta2) if still else recording["theta2"]
        at = np.array([np.interp(theta2, self.places, row) for row in np.eye(len(self.places))])
        return np.asarray(np.einsum("kt,kty->ty", at, np.array(all_outputs)))

    def poles(self, theta2: float) -> np.ndarray:
        A = self.models[int(np.argmin(np.abs(self.places - theta2)))].A
        return np.asarray(np.log(np.linalg.eigvals(A).astype(complex)) / self.sample_time)

    def result(self) -> dict[str, Any]:
        return {"orders": [len(m.A) for m in self.models]}


def _blended(identified: Identified, _: Rig, data: Sequence[Recording], __: Any) -> Contender:
    models = [identified(references(r), outputs(r), ORDERS) for r in data]
    return Blended(models, np.array([float(r.theta2 or 0.0) for r in data]), data[0].sample_time)


def arm(_: Path) -> dict[str, Any]:
    """The baselines of the paper's study, and these, on the same recordings."""
    rig = Rig(make_settings(read_scenario(SCENARIO)))
    more = {f"{name}, outputs interpolated": partial(_blended, identified)
            for name, identified in IDENTIFIED.items()}  # fmt: skip
    kept = {name: baselines.METHODS[name] for name in ("glocal", "interpolated black box")}
    with patch.dict(baselines.METHODS, kept | more, clear=True):
        found = Baselines().run(rig, {"snr_db": SNR_DB, "points": POINTS})
    return {one["method"]: {k: one[k] for k in ("fit", "pole_error", "parameters", "seconds")}
            for one in found["methods"]}  # fmt: skip


REPEATS = 6
SAMPLES = (500, 4000)


def known_system(_: Path) -> dict[str, Any]:
    """Four stable states, two inputs and outputs, white noise of half the output's spread: bias and
    spread of the pair of poles that swings, relative to its distance from the origin."""
    rng = np.random.default_rng(2)
    A = np.diag([0.9, 0.7, 0.0, 0.0])
    A[2:, 2:] = 0.95 * np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])
    true = StateSpace(A, rng.standard_normal((4, 2)), rng.standard_normal((2, 4)))
    poles, found = np.linalg.eigvals(A), dict[str, Any]()
    for name, identified in IDENTIFIED.items():
        for count in SAMPLES:
            clock, swinging, errors = time.process_time(), list[complex](), list[float]()
            for seed in range(REPEATS):
                noise = np.random.default_rng([seed, count])
                u = noise.standard_normal((count, 2))
                y = true.respond(u)
                y = y + 0.5 * y.std(axis=0) * noise.standard_normal(y.shape)
                own = np.linalg.eigvals(identified(u, y, (4,)).A)
                swinging.append(own[np.argmin(np.abs(own - 0.95 * np.exp(0.3j)))])
                errors.append(pole_error(own, poles))
            away = np.array(swinging) - 0.95 * np.exp(0.3j)
            found[f"{name}, {count} samples"] = {
                "bias": float(abs(np.mean(away))) / 0.95, "spread": float(np.std(away)) / 0.95,
                "poles": float(np.mean(errors)),
                "seconds": (time.process_time() - clock) / REPEATS,
            }  # fmt: skip
    return found


CASES: dict[str, Callable[[Path], dict[str, Any]]] = {"known_system": known_system, "arm": arm}

ABOUT = f"""\
`nfoursid` is N4SID as a package. First a known system of four states in much white noise, six \
times: is it biased? Then {POINTS} working points of the paper's arm at {SNR_DB:g} dB: a model \
per point, whose outputs are interpolated over θ2, beside the glocal fit of the stiffness and the \
program's own subspace models (their outputs interpolated likewise, and their matrices). FIT in \
per cent on recordings without noise that nothing has seen."""


def summary(found: Mapping[str, Any]) -> Summary:
    """FIT at working points that nobody has seen."""
    if "arm" not in found:
        return []
    unseen = {name: one["fit"]["unseen"] for name, one in found["arm"].items()}
    ours = unseen.pop("glocal")
    peer = max(unseen, key=unseen.__getitem__)
    return [(
        "paper's arm, 20 dB: FIT at unseen working points", f"{ours:.2f} %, glocal",
        f"{unseen[peer]:.2f} %, {peer}", better(-ours, -unseen[peer]),
    )]  # fmt: skip


def section(found: Mapping[str, Any]) -> str:
    """Markdown."""
    texts = [ABOUT]
    if "known_system" in found:
        rows = [
            [name, f"{one['bias']:.2%}", f"{one['spread']:.2%}", f"{one['poles']:.1%}",
             f"{one['seconds']:.2f} s"]
            for name, one in found["known_system"].items()
        ]  # fmt: skip
        head = ("known system", "bias of the swinging pole", "its spread",
                "mean error of all poles", "processor time")  # fmt: skip
        texts.append(table(head, rows))
    if "arm" in found:
        rows = [[name, *(f"{one['fit'][kind]:.1f}" for kind in ("identified", "unseen", "sweeps")),
                 f"{one['pole_error']:.1%}", str(one["parameters"]), f"{one['seconds']:.1f} s"]
                for name, one in found["arm"].items()]  # fmt: skip
        head = ("paper's arm", "identified points", "unseen points", "sweeps", "poles off",
                "numbers", "time")  # fmt: skip
        texts.append(table(head, rows))
    return "\n\n".join(texts)
