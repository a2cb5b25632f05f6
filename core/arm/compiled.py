"""The compiled equations of an arm, made once and kept in the user's cache folder."""

from __future__ import annotations

import hashlib
import sys
import threading
from dataclasses import dataclass
from functools import cache, cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from ..arm.arm import Structure
from ..arm.cache import cached_module, module_file, sources_key
from ..progress import announce

COMPILING = "Compiling an arm of this structure, once (up to a minute)"

_LOADING = threading.Lock()
"""A second thread must not meet a module that is still being executed."""


@dataclass(frozen=True)
class CompiledArm:
    """Compiled functions of one structure, each taking the parameter vector p of core.arm.slots.

    `dynamics(q, v, p, M, f)`, `tip(q, p, z, J)`, `linear(q, p, K, D)` fill their last two
    arguments. They are C functions: other compiled code takes them as arguments without being
    compiled again.
    """

    structure: Structure
    dynamics: Any
    tip: Any
    linear: Any

    def __reduce__(self) -> tuple[Any, ...]:
        """Another process makes it from the structure, out of the same cache."""
        return compile_arm, (self.structure,)

    @cached_property
    def addresses(self) -> np.ndarray:
        """(3,) of `dynamics`, `tip` and `linear`, for core.arm.signatures."""
        functions = (self.dynamics, self.tip, self.linear)
        return np.array([function.address for function in functions], dtype=np.int64)

    def mass_matrix(self, q: np.ndarray, p: np.ndarray) -> np.ndarray:
        """M (n, n) at q (n,) with the numbers p (np,)."""
        return self.mass_and_force(q, np.zeros_like(q), p)[0]

    def mass_and_force(
        self, q: np.ndarray, v: np.ndarray, p: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """M(q) (n, n) and F(q, v) (n,) without the drive; q and v = q' (n,), p (np,)."""
        from ..arm.evaluation import call_dynamics

        return call_dynamics(self.addresses, *_floats(q, v, p))

    def tip_place(self, q: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """z (2,) in m and dz/dq (2, n) at q (n,) with the numbers p (np,)."""
        from ..arm.evaluation import call_tip

        return call_tip(self.addresses, *_floats(q, p))

    def tip_places(self, q: np.ndarray, p: np.ndarray) -> np.ndarray:
        """z (N, 2, S) in m along S motions q (N, n, S), each with its own numbers p (S, np)."""
        from ..arm.evaluation import tip_places

        return tip_places(self.addresses, *_floats(q, p))

    def linear_matrices(self, q: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """K = -dF/dq and D = -dF/dq' (n, n) of the straight arm at the joint positions in q (n,);
        p (np,). Of S places q (S, n) with p (S, np) each, (S, n, n)."""
        from ..arm.evaluation import call_linear

        K, D = call_linear(self.addresses, *_floats(np.atleast_2d(q), np.atleast_2d(p)))
        return (K, D) if q.ndim > 1 else (K[0], D[0])


def _floats(*arrays: np.ndarray) -> list[np.ndarray]:
    return [np.ascontiguousarray(a, dtype=float) for a in arrays]


@cache
def _key(structure: Structure) -> str:
    """Changes with the structure and with the code that derives its equations."""
    import numba

    text = repr((structure, numba.__version__, sources_key()))
    return hashlib.sha256(text.encode()).hexdigest()[:20]


def _name(structure: Structure) -> str:
    return f"arm_{_key(structure)}"


def is_compiled(structure: Structure) -> bool:
    """Whether this structure was met before on this machine, so that it is there at once."""
    return module_file(_name(structure)).exists()


def _module_text(structure: Structure, wide: bool = False) -> str:
    from ..arm.generate import ArmCode
    from ..arm.kinematics import Kinematics

    announce(COMPILING)
    return ArmCode(Kinematics(structure)).module(wide)


@cache
def compile_arm(structure: Structure) -> CompiledArm:
    """The compiled arm; a second or two the first time, from the cache after that."""
    with _LOADING:
        module = cached_module(_name(structure), partial(_module_text, structure))
    return CompiledArm(structure, module.dynamics, module.tip, module.linear)


@cache
def statements_of(structure: Structure, function: str) -> tuple[str, ...]:
    """The assignments of `dynamics`, `tip` or `linear` as they are compiled."""
    compile_arm(structure)
    text = Path(sys.modules[f"flexgui_{_name(structure)}"].__file__ or "").read_text("utf-8")
    head = f"def {function}_statements("
    body = text.partition(head)[2].partition("\n\n")[0]
    return tuple(line.strip() for line in body.splitlines()[1:])


@dataclass(frozen=True)
class WideArm:
    """`dynamics` and `tip` of LANES arms side by side; arrays are (entries, LANES)."""

    dynamics: Any
    tip: Any
    solvers: tuple[Any, ...]
    """`factor`, `substitute`, `solve_positive`, `multiply`, `subtract` of core.arm.solvers."""

    @cached_property
    def addresses(self) -> np.ndarray:
        """(7,) of `dynamics`, `tip` and the `solvers`, for core.arm.signatures."""
        functions = (self.dynamics, self.tip, *self.solvers)
        return np.array([function.address for function in functions], dtype=np.int64)


@cache
def compile_wide_arm(structure: Structure) -> WideArm:
    """The same for LANES arms; seconds the first time, from the cache after that."""
    with _LOADING:
        text = partial(_module_text, structure, wide=True)
        module = cached_module(f"wide_{_name(structure)}", text)
    solvers = (
        module.factor, module.substitute, module.solve_positive, module.multiply, module.subtract
    )  # fmt: skip
    return WideArm(module.dynamics, module.tip, solvers)
