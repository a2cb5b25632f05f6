"""How many damaged columns, clocks and rows the check names, on rigs of every kind of drive.

`python -m tests.programs.sample.damage_table [--seeds 2] [words]`, minutes: a line per rig, fault,
and what is said of the untouched recordings; then the seconds of one recording.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tests.check.faults import FAULTS
from tests.check.rigs import Rig, independent, rig
from tests.check.test_faults import outcome
from tests.programs.sample.torque_rigs import TorqueRig, written
from tests.programs.studies.checked_rigs import checked_rig

TWO = TorqueRig((4.0, 2.5), (0.5, 0.4), viscous=(0.8, 0.5), coulomb=(1.0, 0.6))
BEAM = TorqueRig((4.0,), (0.8,), stiffness=(200.0,), hub_inertia=0.1, viscous=(0.5,))
SOFT = TorqueRig((3.0,), (0.6,), hub_inertia=0.1, springs=(900.0,), rate=500.0, seconds=2.0)
COMPLIANCE = 1.1e-3
"""rad/(N m), as the soft rig's newcomer states it."""


def _made(what: TorqueRig, compliance: float = 0.0) -> Rig:
    with TemporaryDirectory() as folder:
        path = written(what, 7, Path(folder))
        if compliance:
            text = path.read_text(encoding="utf-8")
            soft = text.replace("modes = 0\n", f"modes = 0\njoint_compliance = {compliance}\n")
            path.write_text(soft, encoding="utf-8")
        return rig(path)


RIGS = {
    "velocity_loop": partial(independent, "coulomb_friction", 3),
    "velocity_loop_soft": partial(checked_rig, 2),
    "velocity_loop_friction": partial(checked_rig, 25),
    "torque_rigid": partial(_made, TWO),
    "torque_bending": partial(_made, BEAM),
    "torque_camera": partial(checked_rig, 28),
    "soft_joint": partial(_made, SOFT, COMPLIANCE),
}


def lines(words: list[str], seeds: int) -> Iterator[dict[str, Any]]:
    """One per rig: seconds, what is said of it untouched, and (named, possible) by fault."""
    for name, make in RIGS.items():
        if words and not any(word in name for word in words):
            continue
        one = make()
        one.untouched(0)  # compiled
        start = time.perf_counter()
        said = [f"{f.channel}: {f.fault}" for k in range(len(one.cases)) for f in one.untouched(k)]
        seconds = (time.perf_counter() - start) / len(one.cases)
        outcomes = {f: [outcome(one, 1, f, seed) for seed in range(seeds)] for f in FAULTS}
        whole = time.perf_counter() - start
        named = {f: [x for x in all_ if x is not None] for f, all_ in outcomes.items()}
        yield {
            "rig": name, "untouched": said, "seconds": round(seconds, 2), "whole": round(whole),
            "named": {f: [sum(each), len(each)] for f, each in named.items() if each},
        }  # fmt: skip


def main() -> None:
    """Prints the lines and their sums."""
    ask = argparse.ArgumentParser(description=__doc__)
    ask.add_argument("words", nargs="*")
    ask.add_argument("--seeds", type=int, default=2)
    given = ask.parse_args()
    total: dict[str, list[int]] = {}
    for line in lines(given.words, given.seeds):
        print(json.dumps(line), flush=True)
        for fault, (named, possible) in line["named"].items():
            before = total.get(fault, [0, 0])
            total[fault] = [before[0] + named, before[1] + possible]
    print(json.dumps(total), sum(n for n, _ in total.values()), sum(p for _, p in total.values()))


if __name__ == "__main__":
    main()
