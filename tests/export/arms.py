"""Models whose exports are run: drives of every kind, one to three segments, slides, ground."""

from __future__ import annotations

from flexgui.core.drives import build_drive
from flexgui.core.drives.torque import Torque
from flexgui.core.model import Model
from tests.helpers import ARMS, loaded, looped

GRAVITY = (1.5, -9.81)

FEEDBACK = build_drive(
    "state_feedback",
    {
        "gains": [[50.0, 8.0, 3.0, 0.5], [30.0, 5.0, 2.0, 0.2]],
        "torque_constants": [1.5, 0.8],
        "rate_filter": 300.0,
    },
)

MODELS: dict[str, Model] = {
    **{f"loop {name}": looped(loaded(ARMS[name]), 20.0, "lpv") for name in
       ("1-1", "2-2", "3-3", "slide", "ground", "0-2-1")},
    "loop under gravity": looped(loaded(ARMS["2-2"], GRAVITY), level="lpv"),
    "states of a drive": Model(loaded(ARMS["1-1"]), FEEDBACK, "lpv"),
    "torque": Model(loaded(ARMS["2-2"]), Torque(), "lpv"),
}  # fmt: skip
