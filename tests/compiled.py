"""`python -m tests.compiled`: compile what nearly every test needs, once per machine.

All processes, and the workers of each, would compile the same at the same time.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]

ARMS = """
from dataclasses import replace
from flexgui.core.arm.compiled import compile_arm, compile_wide_arm
from flexgui.core.arm.arm import Structure
from flexgui.core.effects import catalogue
from flexgui.core.scenario.stated_effects import candidate_structures
from tests.helpers import PAPER
softer = [replace(Structure.of(PAPER), elastic=soft) for soft in ((True, False), (False, True))]
for structure in [*candidate_structures(PAPER, list(catalogue().values())), *softer][{}::2]:
    compile_arm(structure), compile_wide_arm(structure)
"""
"""Every second one of the structures that a diagnosis tries, those with one elastic joint too."""
KERNEL = "from {} import {} as kernel; kernel.compiled\n"
HALVES = (
    KERNEL.format("flexgui.core.simulate.rosenbrock", "integrate")
    + KERNEL.format("flexgui.core.simulate.piecewise", "piecewise")
    + ARMS.format(0),
    KERNEL.format("flexgui.core.simulate.along_motion", "followed")
    + KERNEL.format("flexgui.core.simulate.linear", "respond_lanes")
    + ARMS.format(1),
)
"""Neither compiles what the other does."""
MARK = (
    "from flexgui.core.precompile import compile_kernels; "
    "from flexgui.core.progress import Silent; compile_kernels(Silent())"
)
"""Finds all of it there, and says so to the next start."""


def compile_shared() -> None:
    """In two processes, where it was not done before."""
    from flexgui.core.precompile import kernels_compiled

    if kernels_compiled():
        return
    halves = [subprocess.Popen([sys.executable, "-c", text], cwd=ROOT) for text in HALVES]
    for half in halves:
        half.wait()
    subprocess.run([sys.executable, "-c", MARK], cwd=ROOT)


if __name__ == "__main__":
    compile_shared()
