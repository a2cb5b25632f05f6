"""Forty rigs whose torque is recorded, without and with a stated filter: one table.

    python -m tests.studies.torque_rigs_table [--filter] [seeds ...]

Every fifth hides nothing, viscous or Coulomb friction, a payload, or soft joints; arms, rates,
encoders and sizes are drawn. What was answered is kept in `reports/`.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from tests.sample.judge import named
from tests.sample.torque_rigs import SWINGS, TorqueRig, written

RIGS = 40
HIDDEN = ("", "viscous_friction", "coulomb_friction", "tip_payload", "joint_elasticity")
ARMS = (
    TorqueRig((3.0,), (0.6,)),
    TorqueRig((4.0, 2.5), (0.5, 0.4)),
    TorqueRig((5.0, 3.0, 1.5), (0.45, 0.4, 0.3)),
    TorqueRig((6.0,), (0.8,), hub_inertia=0.3),
    TorqueRig((3.0, 2.0), (0.4, 0.4), hub_inertia=0.1),
    TorqueRig((6.0, 3.0, 2.0), (0.5, 0.4, 0.3), hub_inertia=0.05),
    TorqueRig((4.0,), (0.8,), stiffness=(800.0,), hub_inertia=0.1, modes=3, hinges=20),
    TorqueRig(
        (5.0, 3.0), (0.5, 0.5), stiffness=(2000.0, 1200.0), hub_inertia=0.1, modes=3, hinges=20
    ),
)
"""Those that bend stay within about a hundredth of their lengths. Further, a real beam stiffens
(its energy has a term 1/2 EI (w' w'')^2), which is rightly called cubic stiffness."""
CUTOFFS = {False: 20.0, True: 60.0}
"""Hz, of the stated filter: of arms that are rigid, and of those that bend."""
CLOSE, FRICTION_CLOSE = 0.03, 0.05
"""Relative, that sizes may be off."""
QUICK = 30.0
"""s"""
REACH = 0.5
"""rad, of the motions."""


def drawn(seed: int) -> tuple[TorqueRig, str, dict[str, float]]:
    """A rig, what it hides, and the truth by name."""
    kind, rng = HIDDEN[seed % len(HIDDEN)], np.random.default_rng([77, seed])
    rig = ARMS[seed // len(HIDDEN)]
    if kind == "tip_payload" and rig.joints == 1 and not rig.stiffness:
        kind = "viscous_friction"  # one rigid link has one inertia, whatever is at its tip
    bits = int(rng.integers(12, 21))
    rate = float(rng.choice([200.0, 500.0, 1000.0, 2000.0]))
    rig = replace(rig, bits=bits, rate=rate, counts=0.3 if bits < 16 else 1.0, seconds=4.0)
    middle = np.array([0.0, 1.1, -0.6][: rig.joints])
    inertia = np.diag(rig.inertia(middle)) + rig.hub_inertia
    fastest = 2.0 * np.pi * SWINGS[2]
    torque = inertia * REACH * fastest**2 / 2.0
    share = rng.uniform(0.05, 0.2, rig.joints)
    letter = "EI" if rig.stiffness else "m"
    truth = {f"{letter}{k + 1}": x for k, x in enumerate(rig.stiffness or rig.masses)}
    if kind == "viscous_friction":
        rig = replace(rig, viscous=_values(share * torque / (REACH * fastest)))
        truth |= {f"fv{k + 1}": x for k, x in enumerate(rig.viscous)}
    if kind == "coulomb_friction":
        rig = replace(rig, coulomb=_values(share * torque))
        truth |= {f"fc{k + 1}": x for k, x in enumerate(rig.coulomb)}
    if kind == "tip_payload":
        rig = replace(rig, payload=float(round(rng.uniform(0.08, 0.25) * rig.masses[-1], 4)))
        truth[f"mt{rig.joints}"] = rig.payload
    if kind == "joint_elasticity":
        # A loop holds a motor behind a spring by itself: a light one, sampled seldom, is unstable.
        hub = rig.hub_inertia or float(round(0.3 * inertia.max(), 3))
        rig = replace(rig, rate=max(rig.rate, 500.0), hub_inertia=hub)
        rig = replace(rig, springs=_values(torque / (0.02 * share + 0.002)))
        truth |= {f"c{k + 1}": 1.0 / x for k, x in enumerate(rig.springs)}
    return rig, kind, truth


def _values(sizes: np.ndarray) -> tuple[float, ...]:
    return tuple(float(f"{x:.4g}") for x in sizes)


def answer(seed: int, filtered: bool) -> dict[str, Any]:
    """What the diagnosis of one rig says, as plain values."""
    from flexgui.core.identify.predictor import single_threaded
    from flexgui.core.scenario.read import read_scenario
    from flexgui.core.workbench import run_scenario

    rig, kind, truth = drawn(seed)
    with TemporaryDirectory() as folder, single_threaded():
        path = written(rig, 500 + 10 * seed, Path(folder))
        if filtered:
            stated = f"[identify]\nfilter = {{ cutoff_hz = {CUTOFFS[bool(rig.stiffness)]} }}\n"
            path.write_text(path.read_text("utf-8").replace("[identify]\n", stated), "utf-8")
        begun = time.perf_counter()
        found = run_scenario(read_scenario(path), folder=path.parent).diagnosis
        seconds = time.perf_counter() - begun
    assert found is not None
    values = {e.name: e.value for e in found.parameters}
    off = {n: abs(values[n] / x - 1.0) for n, x in truth.items() if n in values}
    return {
        "seed": seed, "joints": rig.joints, "bends": bool(rig.stiffness), "rate": rig.rate,
        "bits": rig.bits, "hidden": kind, "found": list(found.steps[-1].model),
        "verdict": found.final_verdict, "off": off, "missing": sorted(set(truth) - set(off)),
        "error": float(found.steps[-1].cost_per_sample) ** 0.5, "seconds": seconds,
    }  # fmt: skip


def is_right(one: dict[str, Any]) -> bool:
    """Whether what is hidden is named and nothing else, and nothing is said to be left."""
    hidden = {one["hidden"]} - {""}
    return one["verdict"] == "nothing_missing" and named(one["found"]) == hidden


def is_close(one: dict[str, Any]) -> bool:
    """Whether all sizes are as close as asked."""
    limits = {n: FRICTION_CLOSE if n[:2] in ("fv", "fc") else CLOSE for n in one["off"]}
    return not one["missing"] and all(x <= limits[n] for n, x in one["off"].items())


def line(one: dict[str, Any]) -> str:
    """One rig in one line."""
    worst = max(one["off"].items(), key=lambda item: item[1], default=("-", 0.0))
    arm = f"{one['joints']} {'bends' if one['bends'] else 'rigid'}"
    marks = f"{'right' if is_right(one) else 'WRONG'} {'close' if is_close(one) else 'FAR'}"
    return (
        f"{one['seed']:3d} {arm} {one['rate']:5.0f} Hz {one['bits']} bits "
        f"{one['hidden'] or 'nothing':18s}{marks:12s} {one['verdict'] or '-':16s}"
        f"{worst[0]} {100.0 * worst[1]:5.1f} %  {one['error']:5.2f} {one['seconds']:5.0f} s  "
        f"{'+'.join(one['found']) or 'nothing'}"
    )


def _answered(job: tuple[int, bool]) -> dict[str, Any]:
    try:
        return answer(*job)
    except Exception as error:  # a rig that fails is a wrong one, and the others go on
        return {"seed": job[0], "failed": f"{type(error).__name__}: {error}"}


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs what is not known yet and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seeds", nargs="*", type=int, default=list(range(RIGS)))
    parser.add_argument("--filter", action="store_true", help="with a stated low-pass filter")
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args(arguments)
    path = Path("reports") / f"torque_rigs{'_filtered' * given.filter}.jsonl"
    path.parent.mkdir(exist_ok=True)
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    found = [json.loads(text) for text in lines]
    jobs = [(n, given.filter) for n in given.seeds if n not in {one["seed"] for one in found}]
    for one in found:
        print(one.get("failed") or line(one), flush=True)
    with ProcessPoolExecutor(given.workers, get_context("spawn")) as pool:
        for one in pool.map(_answered, jobs):
            found.append(one)
            print(one.get("failed") or line(one), flush=True)
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(one) + "\n")
    known = [one for one in found if "failed" not in one]
    print(
        f"right {sum(map(is_right, known))} of {len(found)}, close "
        f"{sum(map(is_close, known))}, within {QUICK:.0f} s "
        f"{sum(one['seconds'] <= QUICK for one in known)}"
    )


if __name__ == "__main__":
    main()
