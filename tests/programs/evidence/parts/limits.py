"""Where it fails, and studies that have a command of their own."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

TITLE = "Limits, and what stands elsewhere"
ORDER = 9
FILES: tuple[str, ...] = ()
CASES: dict[str, Callable[[Path], dict[str, Any]]] = {}

TEXT = """\
- **The free run of EMPS** is worse than the best published one. No estimator that the first
  recording could choose corrects this. Friction changes between the recordings. A force that
  depends on the position is not in the catalogue (see there).
- **EMPS is not explained to its noise**: after three effects the verdict is `unlisted`.
- **One assumed mode per link is no beam**: its second clamped frequency is off by a factor of two.
  The exported MJCF states this in its header. With three modes the first three frequencies are
  within one per cent.
- **ε and d** of a square section cannot be distinguished by any recording of this arm; see
  `docs/teaching/2_valley.md`.

Studies with a command of their own, which prints their figures:

- `make matrix`: plain scenarios of random rigs, with nothing hidden, with what the catalogue has
  and with what it has not, and planned experiments; some hours. `make sample` takes thirty of these
  and of the engine's cases and compares with the stored answers in `tests/programs/sample`.
- `python -m pytest -m long tests/mujoco`: the shipped recordings of the independent engine; the
  tests state what must be named, and how near each size must be.
- `make study`: the paper's Monte Carlo study, as tables and figures in `studies/`; the baselines
  of one of its settings stand above, under subspace models.\
"""


def section(found: Mapping[str, Any]) -> str:
    """Markdown."""
    return TEXT
