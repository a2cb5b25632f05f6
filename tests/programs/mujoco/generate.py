"""Make the recordings in scenarios/mujoco.

`python -m tests.programs.mujoco.generate [--case NAME]`.

Takes half an hour for all; what is on disk already is not made again.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from tests.programs.mujoco.cases import CASES, EXPERIMENTS, Case
from tests.programs.mujoco.files import table, write_plain, write_scenario, write_table, write_truth
from tests.programs.mujoco.simulate import run

FOLDER = Path(__file__).resolve().parents[3] / "scenarios" / "mujoco"


def make(case: Case, folder: Path) -> None:
    """All recordings of one case that are missing, and its scenario."""
    for experiment in EXPERIMENTS:
        path = folder / case.name / f"{experiment.name}.csv.gz"
        if path.exists():
            continue
        start = time.perf_counter()
        motion = run(case.plant, experiment.theta2, experiment.reference, case.step)
        write_table(table(case.name, experiment.name, motion), path)
        seconds = time.perf_counter() - start
        print(f"{case.name}/{experiment.name}: {seconds:.0f} s", flush=True)
    write_scenario(case, folder)
    write_plain(case, folder)


def main() -> None:
    """Read the command line and make what it asks for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    names = [case.name for case in CASES]
    parser.add_argument("--case", choices=names, help="one case only; all without it")
    parser.add_argument("--out", type=Path, default=FOLDER, help="folder, scenarios/mujoco if none")
    chosen = parser.parse_args()
    write_truth(CASES, chosen.out / "truth.toml")
    for case in CASES:
        if chosen.case in (None, case.name):
            make(case, chosen.out)


if __name__ == "__main__":
    main()
