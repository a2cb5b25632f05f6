"""What a design leaves on disk: references to play, what to expect, and how to read it back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..experiments.design import Candidate, Design
from ..recording.recording import Recording
from ..recording.spec import SimulateSpec
from ..scenario.schema import Scenario
from ..simulate.experiment import NO_NOISE, read_sensors

Document = dict[str, Any]


@dataclass(frozen=True)
class Names:
    """Of the files of experiment n, from 1."""

    number: int

    @property
    def play(self) -> str:
        """The references to be played."""
        return f"play{self.number}.csv"

    @property
    def expected(self) -> str:
        """What the sensors should read, without noise."""
        return f"expected{self.number}.csv"

    @property
    def recorded(self) -> str:
        """Where the recording of it belongs."""
        return f"recorded{self.number}.csv"


def references(c: Candidate, design: Design) -> Recording:
    """The references of an experiment, to be played sample by sample."""
    model = design.fitted.model
    task, _ = c.trial.task(model)
    names = model.drive.reference_channels(model.arm)
    return Recording(
        c.trial.form, task.time, {n: task.references[:, k] for k, n in enumerate(names)}
    )


def expected(c: Candidate, design: Design) -> Recording:
    """What the fitted model's sensors read, without noise."""
    model = design.fitted.model
    spec = SimulateSpec(sample_time=c.trial.sample_time, seconds=c.trial.seconds)
    channels = read_sensors(model, c.trial.motion(design.fitted), spec, NO_NOISE)
    time = np.arange(len(next(iter(channels.values())))) * c.trial.sample_time
    return Recording(c.trial.form, time, channels)


def with_planned(scenario: Scenario, design: Design, locate: Callable[[str], str]) -> Document:
    """The scenario with the planned experiments beside its own recordings. `locate` gives the place
    of a file that the scenario names, as the new one names it."""
    document: Document = scenario.model_dump(exclude_unset=True)
    listed = [_moved(r, locate) for r in document.get("recordings", ())]
    for number, _ in enumerate(design.chosen, start=1):
        names = Names(number)
        planned = {"file": names.recorded, "played": names.play}
        listed.append({"name": _free(f"planned {number}", listed), **planned})
    return {**document, "recordings": listed}


def _free(name: str, listed: Sequence[Document]) -> str:
    """The name, or the next that no recording has: a plan may follow a plan."""
    taken = {recording.get("name") for recording in listed}
    numbers = (f"{name} ({k})" for k in range(2, len(taken) + 3))
    return next(n for n in (name, *numbers) if n not in taken)


def _moved(recording: Document, locate: Callable[[str], str]) -> Document:
    return {k: locate(v) if k in ("file", "played") and v else v for k, v in recording.items()}
