"""Compiled force laws, made once and kept in the user's cache folder."""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Callable
from functools import cache, lru_cache, partial
from types import ModuleType

import numba
import numpy as np
import sympy as sp

from ..arm.cache import cached_module, sources_key
from ..forces.generate import module_text, wide_module_text
from ..forces.interpreted import InterpretedLaw, wide
from ..forces.law import ForceLaw

_LOADING = threading.Lock()


class CompiledLaw:
    """The C function of a law; `address` is what the integrator calls."""

    def __init__(self, law: ForceLaw, function: object) -> None:
        self.law = law
        self._function = function  # kept alive, since only its address goes further
        self.address = int(function.address)  # type: ignore[attr-defined]

    def __call__(
        self, x: np.ndarray, v: np.ndarray, w: np.ndarray, values: np.ndarray
    ) -> np.ndarray:
        """The outputs of `ForceLaw.outputs` as numbers."""
        out = np.zeros(self.law.size)
        arrays = [np.ascontiguousarray(a, dtype=float) for a in (x, v, w, values)]
        pointers = [a.ctypes.data_as(_pointer_type()) for a in (*arrays, out)]
        self._function.ctypes(*pointers)  # type: ignore[attr-defined]
        return out


@cache
def _pointer_type():  # type: ignore[no-untyped-def]
    import ctypes

    return ctypes.POINTER(ctypes.c_double)


KNOWN = 128
"""Formulas that are at hand; a model has a few, and they are soon compiled again."""


def compile_law(law: ForceLaw) -> CompiledLaw | InterpretedLaw:
    """A tenth of a second the first time, from the cache after that; a formula when needed."""
    return _passing(law) if law.interpreted else _kept(law)


def compile_wide_law(law: ForceLaw) -> CompiledLaw | InterpretedLaw:
    """The same for LANES arms side by side; its `address` takes rows of LANES doubles."""
    return _wide_passing(law) if law.interpreted else _wide_kept(law)


_passing = lru_cache(KNOWN)(InterpretedLaw)
_wide_passing = lru_cache(KNOWN)(wide)


@cache
def _kept(law: ForceLaw) -> CompiledLaw:
    return CompiledLaw(law, _loaded("force", law, module_text).element)


@cache
def _wide_kept(law: ForceLaw) -> CompiledLaw:
    return CompiledLaw(law, _loaded("wide_force", law, wide_module_text).element)


def _loaded(stem: str, law: ForceLaw, write: Callable[[ForceLaw], str]) -> ModuleType:
    text = repr((sp.srepr(law.outputs()), law.x, law.v, law.states, law.parameters))
    key = hashlib.sha256(f"{text}{numba.__version__}{sources_key()}".encode()).hexdigest()[:20]
    with _LOADING:
        return cached_module(f"{stem}_{key}", partial(write, law))
