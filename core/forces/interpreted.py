"""Force laws that somebody typed: nothing of them is kept on disk, and most are never compiled.

A law of the catalogue is compiled once for ever. A formula is tried, changed and forgotten, and
what Numba has compiled stays in the memory of its process: so it is worked out in plain Python
where numbers are asked for, and compiled only where an integrator wants its address.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import cached_property
from importlib.abc import InspectLoader
from importlib.util import module_from_spec, spec_from_loader
from typing import Any

import numpy as np

from ..forces.generate import module_text, plain_text, wide_module_text
from ..forces.law import ForceLaw

_COMPILING = threading.Lock()


class InterpretedLaw:
    """A law as `CompiledLaw` has it: a call with numbers, and an address."""

    def __init__(self, law: ForceLaw, write: Callable[[ForceLaw], str] = module_text) -> None:
        self.law, self._write = law, write

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
        """Of its C function, which is compiled by the first who asks."""
        with _COMPILING:
            return int(self._function.address)

    @cached_property
    def _plain(self) -> Callable[..., None]:
        function: Callable[..., None] = _defined(plain_text(self.law))
        return function

    @cached_property
    def _function(self) -> Any:
        # A cache on disk would keep a file for every formula that was ever typed.
        return _defined(self._write(self.law).replace('"cache": True', '"cache": False'))


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


def wide(law: ForceLaw) -> InterpretedLaw:
    """The same for LANES arms side by side; only its address is of use."""
    return InterpretedLaw(law, wide_module_text)
