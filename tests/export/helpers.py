"""Models whose exports are run, outcomes of them without a run, and what a report's figures say."""

from __future__ import annotations

import base64
import gzip

import numpy as np

from flexgui.core.drives import build_drive
from flexgui.core.drives.torque import Torque
from flexgui.core.model import Model
from flexgui.core.results import Outcome
from flexgui.core.simulate.descriptor import descriptor
from flexgui.core.simulate.mechanism import mechanism
from flexgui.core.simulate.state_equations import state_equations
from tests.helpers import ARMS, loaded, looped


def outcome_of(model: Model, title: str = "A test") -> Outcome:
    """What an export of this model is made from."""
    values = dict(model.effect_values)
    return Outcome(
        title, "glocal", "lpv", (), (), descriptor(model, model.numbers(values)), (),
        mechanism=mechanism(model, values), state_equations=state_equations(model, values),
    )  # fmt: skip


def inputs(samples: int, count: int, seed: int = 5) -> np.ndarray:
    """(samples, count) random steps, held ten samples each."""
    rng = np.random.default_rng(seed)
    steps = rng.choice([-0.3, 0.3], (samples // 10 + 1, count))
    return np.repeat(steps, 10, axis=0)[:samples]


def figure_text(page: str) -> str:
    """JSON of all figures of a report, as its script unpacks it."""
    packed = page.split('id="figures">')[1].split("<")[0]
    content = gzip.decompress(base64.b64decode(packed))
    return content[4 : 4 + int.from_bytes(content[:4], "little")].decode()


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
