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
- **The free run of EMPS** is worse than the best published one, and no estimator that the first
  recording could choose mends it: friction changes between the recordings, and a force that
  depends on the place has no name in the catalogue (see there).
- **EMPS is not explained to its noise**: after three effects the verdict is `unlisted`.
- **One assumed mode per link is no beam**: its second clamped frequency is off by a factor of two,
  which the exported MJCF states in its header. Three modes are within one per cent for the first
  three.
- **ε and d** of a square section cannot be distinguished by any recording of this arm; see
  `docs/teaching/2_valley.md`.

Studies with their own commands, whose figures are not on this page yet: plain scenarios of random
rigs (`make matrix`), the shipped recordings of the independent engine
(`python -m pytest -m long tests/mujoco`), the paper's Monte Carlo study (`make study`).\
"""


def section(found: Mapping[str, Any]) -> str:
    """Markdown."""
    return TEXT
