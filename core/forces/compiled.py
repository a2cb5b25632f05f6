"""Force laws as functions: of plain Python for a few numbers, of C for the integrator.

A law of the catalogue is compiled once and kept in the user's cache folder. A formula that somebody
types is tried, changed and forgotten: nothing of it is kept on disk. What Numba has compiled stays
in the memory of its process, so a law is compiled only where somebody asks for its address.
"""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Callable
from functools import cache, cached_property, lru_cache, partial
from importlib.abc import InspectLoader
from importlib.util import module_from_spec, spec_from_loader
from typing import Any

import numba
import numpy as np
import sympy as sp

from ..arm.cache import cached_module, sources_key
from ..forces.generate import module_text, plain_text, wide_module_text
from ..forces.law import ForceLaw

_LOADING = threading.Lock()


class CompiledLaw:
    """A law to be called with numbers, or by its address from compiled code."""

    def __init__(self, law: ForceLaw) -> None:
        self.law = law

    def __call__(
        self, x: np.ndarray, v: np.ndarray, w: np.ndarray, values: np.ndarray
    ) -> np.ndarray:
        """The outputs of `ForceLaw.outputs` as numbers; not finite where they do not exist."""
        out = np.zeros(self.law.size)
        arrays = [np.asarray(a, dtype=float) for a in (x, v, w, values)]
        with np.errstate(all="ignore"):
            self._plain(*arrays, out)
        return out

    @property
    def address(self) -> int:
        """Of the C function, which is compiled for the first who asks."""
        return int(self._one.address)

    @property
    def wide_address(self) -> int:
        """The same for LANES arms side by side; it takes rows of LANES doubles."""
        return int(self._wide.address)

    @cached_property
    def _plain(self) -> Callable[..., None]:
        function: Callable[..., None] = _defined(plain_text(self.law))
        return function

    @cached_property
    def _one(self) -> Any:
        return _loaded("force", self.law, module_text)

    @cached_property
    def _wide(self) -> Any:
        return _loaded("wide_force", self.law, wide_module_text)


KNOWN = 128
"""Formulas that are at hand; a model has a few, and they are soon compiled again."""

_kept, _passing = cache(CompiledLaw), lru_cache(KNOWN)(CompiledLaw)


def compile_law(law: ForceLaw) -> CompiledLaw:
    """The law as functions; the same ones for equal laws."""
    return _passing(law) if law.interpreted else _kept(law)


def _loaded(stem: str, law: ForceLaw, write: Callable[[ForceLaw], str]) -> Any:
    """The C function of a law: from the cache after the first time, but for a formula."""
    with _LOADING:
        if law.interpreted:
            return _defined(write(law).replace('"cache": True', '"cache": False'))
        text = repr((sp.srepr(law.outputs()), law.x, law.v, law.states, law.parameters))
        key = hashlib.sha256(f"{text}{numba.__version__}{sources_key()}".encode()).hexdigest()[:20]
        return cached_module(f"{stem}_{key}", partial(write, law)).element


def _defined(text: str) -> Any:
    """`element` of a module that is known to nobody else; the text is ours, printed from a law."""
    spec = spec_from_loader("flexgui_formula", _Text(text))
    assert spec is not None and spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.element


class _Text(InspectLoader):
    """A module from its text."""

    def __init__(self, text: str) -> None:
        self._text = text

    def get_source(self, fullname: str) -> str:
        return self._text
