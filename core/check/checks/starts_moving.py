"""A recording whose arm moves before it begins."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...check.case import Case
from ...check.finding import Check, Finding
from ...check.measured_recording import MeasuredRecording
from ...check.sized_faults import CLEAR, SURE
from ...noise.sensor_noise import noise_of

LEAST_START_SPEED = 0.5
"""Of a joint's rms speed: below, a model at rest is right within its noise."""
SPAN, FEWEST_FIRST, MOST_FIRST = 5e-3, 3, 8
"""s, and samples, from which the speed at the start is taken: a drive changes it within ten ms."""
HELD = 0.5
"""Share of the samples at which a reference that steps changes at most; smooth ones always do."""


class StartsMoving(Check):
    """Joints that move before the recording begins."""

    kind = "starts_moving"

    def find(self, case: Case) -> Iterable[Finding]:
        recording = case.recording
        joints = recording.names("theta#")
        if not joints or not recording.begins_in_motion or case.wrong_columns:
            return  # a late reference makes a motion before it
        if _is_from_rest(case):
            return
        count = _undisturbed(recording)
        columns = np.vander(recording.step * np.arange(count), min(count, 3))
        slope = np.linalg.pinv(columns)[-2]
        for name in joints:
            q = recording.even(name)
            speed, noise = float(slope @ q[:count]), noise_of(q) * float(np.linalg.norm(slope))
            usual = float(np.sqrt(np.mean(np.gradient(q, recording.step) ** 2)))
            if abs(speed) > max(SURE * noise, LEAST_START_SPEED * usual):
                sentence = f"{name} moves at {speed:.4g}/s when the recording begins"
                yield case.finding(self.kind, name, speed, "SI/s", sentence)


def _is_from_rest(case: Case) -> bool:
    """Whether the model moves from rest as well: a reference that jumps at once moves a joint of a
    loop within a sample. Where a servo follows the joints, nothing of the kind is asked."""
    if case.search is None or case.search.fit.of.model.steering is not None:
        return False
    fit = case.search.fit
    x = np.where(np.arange(len(fit.x)) < len(fit.x) - fit.of.states, fit.x, 0.0)
    (at_rest,) = fit.of.answers([(fit.recording, x)])
    return at_rest.score < fit.score + CLEAR


def _undisturbed(recording: MeasuredRecording) -> int:
    """Samples up to the next step of a reference: a fast loop turns a joint around within the
    sample after it."""
    count = int(np.clip(round(SPAN / recording.step), FEWEST_FIRST, MOST_FIRST))
    for name in recording.names("dtheta#_ref", "theta#_ref"):
        changes = np.flatnonzero(np.diff(recording.even(name)))
        if 0 < len(changes) < HELD * len(recording.grid):
            # What is given from sample c + 1 on moves no joint up to that sample.
            count = min(count, int(changes[0]) + 2)
    return count
