"""The paper's arm with its loop, and what is quickly identified of it."""

from __future__ import annotations

from typing import Any

import flexgui as fg

LOOP = fg.drives.VelocityLoop(gains=(60.0, 30.0))
QUICK = {"parameters": ["EI1", "EI2"], "output": ["z", "encoder"], "generations": 0}
EI = 520.8333
"""N m², of the paper's arm."""


def rig(recordings: Any = (), **tables: Any) -> fg.Project:
    """With the full equations."""
    return fg.project("paper", LOOP, recordings, model={"level": "nonlinear"}, **tables)
