"""The first start on a machine: compilation shared between two processes.

The compiler works on one function at a time in one process. On a fresh machine a second process
compiles the integrator and a first arm into the cache while this one compiles the rest.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterable
from contextlib import suppress

from core.arm.beforehand import compile_beforehand
from core.arm.cache import cache_folder, sources_key
from core.arm.structure import Structure
from core.progress import Progress

_SECOND = """
import core.simulate.rosenbrock
from core.arm.compiled import compile_arm
from core.arm.presets import presets
from core.arm.structure import Structure
compile_arm(Structure.of(presets()["paper"]))
"""


def is_warm() -> bool:
    """Whether this version's kernels were compiled on this machine before."""
    return (cache_folder() / f"warm_{sources_key()}").exists()


def warm_up(progress: Progress, arms: Iterable[Structure] = ()) -> None:
    """Compiles, or loads, everything that a first result needs; quick when it was done before.

    `arms` that will be needed later are compiled beside it and beyond.
    """
    compile_beforehand(arms)
    helper = None
    if not is_warm():
        progress.stage("Compiling for this machine, once (about half a minute)")
        helper = subprocess.Popen([sys.executable, "-c", _SECOND], stderr=subprocess.DEVNULL)
    import core.simulate.followed
    import core.simulate.linear
    import core.simulate.pieces  # noqa: F401  (importing compiles)

    if helper is not None:
        helper.wait()
        import core.simulate.nonlinear  # noqa: F401

        with suppress(OSError):  # the next start then does it again
            (cache_folder() / f"warm_{sources_key()}").touch()
