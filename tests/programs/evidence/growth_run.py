"""Time and memory of one scenario: `python -m tests.programs.evidence.growth_run AXIS FACTOR`."""

from __future__ import annotations

import json
import re
import resource
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from flexgui.core.scenario.read import read_scenario
from flexgui.core.workbench import run_scenario
from tests.programs.bench.case import write

MODES = 2
CANDIDATES = (
    "viscous_friction", "coulomb_friction", "tip_payload", "camera_delay", "structural_damping",
    "gravity_tilt", "torque_offset", "joint_elasticity", "drive_saturation", "backlash",
    "base_compliance", "stribeck_friction", "rotor_inertia", "air_drag", "drive_gain",
    "sensor_delay",
)  # fmt: skip
HIDDEN = {"fv1": 2.0, "fv2": 1.0}
"""N m s/rad of the viscous friction that is diagnosed."""


def grown(folder: Path, axis: str, factor: int) -> Path:
    """A scenario with `factor` times the samples or recordings of the smallest, or as many
    candidates."""
    if axis == "samples":
        return write(folder, 0.75 * factor, MODES, recordings=2)
    if axis == "recordings":
        return write(folder, 1.5, MODES, recordings=factor)
    end = f"[diagnose]\nmax_effects = 1\ncandidates = {list(CANDIDATES[:factor])}\n"
    return write(folder, 1.0, 1, recordings=2, hidden=HIDDEN, end=end)


def main(axis: str, factor: int) -> None:
    """Prints wall and processor seconds of the second run, and the peak of the memory in MB."""
    with TemporaryDirectory() as folder:
        file = grown(Path(folder), axis, factor)
        scenario = read_scenario(file)
        run_scenario(scenario, folder=file.parent)  # compiles what is new
        wall, cpu = time.perf_counter(), time.process_time()
        run_scenario(scenario, folder=file.parent)
        wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    print(json.dumps({"seconds": wall, "cpu": cpu, "memory": peak_memory()}))


def peak_memory() -> float:
    """The most that this process ever had in MB. Linux passes the `ru_maxrss` of the process that
    started it on to it, but not this one."""
    status = Path("/proc/self/status")
    if status.is_file():
        found = re.search(r"VmHWM:\s*(\d+) kB", status.read_text(encoding="utf-8"))
        if found:
            return int(found.group(1)) / 1024.0
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
