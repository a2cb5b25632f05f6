"""A recording whose arm moves before it begins."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...check.case import Case
from ...check.checks.together import MissingReference
from ...check.finding import Check, Finding
from ...check.gain_and_lag import Relation
from ...check.measured_recording import MeasuredRecording, noise_of
from ...recording.channels import Role, role_of

SHARE = 0.5
"""Of the rms speed: below, a model at rest is right within its noise."""
FIRST = 5
"""Samples of an average speed."""
SPAN = 5e-3
"""s from whose samples the speed at the start is taken: a drive changes it within ten."""
HELD = 0.5
"""Share of the samples at which a reference that steps changes at most; smooth ones always do."""
EARLY = 0.03
"""s in which a vibration of the links still shows that it was there."""
LAGS = 30
"""In that time, for which an answer is learned: milliseconds, however fast the clock."""
SETTLED = 1.5
"""Times the later error: the largest of the untouched recordings of scenarios/mujoco/plain."""
WRONG_FIRST = 2.0
"""Times what the other recordings, or settled ones, show; starts in motion show 1.5 to 60."""
SURE = 5.0
"""Standard deviations of that speed."""


class StartsMoving(Check):
    """The encoders' speed in the first samples, beyond what the references ask for there."""

    kind = "starts_moving"
    compares_channels = True

    def find(self, case: Case) -> Iterable[Finding]:
        if any(one.factor != 1.0 or one.delay for one in case.suspects):
            return  # the speed of a channel that is wrong says nothing
        if any(True for _ in MissingReference().find(case)):
            return
        recording = case.corrected
        wrong = _first_error_ratio(case)
        # What others begin with too is the model's (too few modes), not this recording's.
        unsettled = wrong > WRONG_FIRST and wrong > WRONG_FIRST * max(
            (_first_error_ratio(one) for one in case.others), default=SETTLED
        )
        for name in recording.names("theta#"):
            q = recording.even(name)
            if len(q) < 10 * FIRST:
                continue
            usual = float(
                np.sqrt(np.mean(np.gradient(_block_means(q), recording.step * FIRST) ** 2))
            )
            count = _undisturbed(recording)
            speed, noise = _first_speed(q, recording.step, count)
            asked, expected = 0.0, _from_rest(case, name)
            if expected is not None:
                asked = _first_speed(expected, recording.step, count)[0]
            # Slower than asked is a heavier or softer joint, and no motion before.
            slower = bool(asked) and 0.0 <= speed / asked <= 1.0
            beyond = 0.0 if slower else speed - asked
            clear = max(SHARE * usual, SURE * noise)
            # A model with too few modes asks for up to half the speed (plain one-mode scenarios).
            before = abs(beyond) > max(clear, abs(asked))
            if usual > 0 and (before or (unsettled and abs(speed) > clear)):
                sentence = f"{name} moves at {speed:.4g}/s when the recording begins"
                yield case.finding(self.kind, name, speed, "SI/s", sentence)


def _first_speed(q: np.ndarray, step: float, count: int) -> tuple[float, float]:
    """The slope at the first sample of a parabola through the first few (a line through two), and
    its deviation."""
    columns = np.vander(step * np.arange(count), min(count, 3))
    pinv = np.linalg.pinv(columns)
    return float(pinv[-2] @ q[:count]), noise_of(q) * float(np.linalg.norm(pinv[-2]))


def _undisturbed(recording: MeasuredRecording) -> int:
    """Samples from which the speed at the start is taken: up to the next step of a reference, as a
    fast loop turns a joint around within the sample after it."""
    count = int(np.clip(round(SPAN / recording.step), 3, 8))
    for name in recording.names("dtheta#_ref", "theta#_ref"):
        changes = np.flatnonzero(np.diff(recording.even(name)))
        held = len(changes) < HELD * len(recording.grid)
        if held and len(changes):
            # What is given from sample c + 1 on moves no joint up to that sample.
            count = min(count, int(changes[0]) + 2)
    return count


def _first_error_ratio(case: Case) -> float:
    """How many times larger the error of the model at rest is at the beginning than later: a fast
    loop brings the joints to their speeds within a sample, but not the links."""
    recording, ratios = case.corrected, []
    early = slice(0, _early_samples(case))
    for relation in case.dynamics.relations:
        if relation.expected is None or len(relation.inputs) < 2 or relation.explained < 0.5:
            continue
        error = np.gradient(recording.even(relation.output), recording.step) - _rate_from_rest(
            case, relation
        )
        later = float(np.sqrt(np.mean(error[early.stop :] ** 2)))
        ratios.append(float(np.sqrt(np.mean(error[early] ** 2))) / later if later > 0 else 0.0)
    return max(ratios, default=0.0)


def _early_samples(case: Case) -> int:
    recording = case.corrected
    return min(max(int(EARLY / recording.step), FIRST), len(recording.grid) // 2)


def _rate_from_rest(case: Case, relation: Relation) -> np.ndarray:
    """The speed (M,) of a channel from a start at rest: the model's, and what the model misses
    after every step of the references, learned from the steps after the first moments."""
    recording, early = case.corrected, _early_samples(case)
    key = "rate from rest", relation.key, relation.gain
    assert relation.expected is not None
    if key in recording.cache:
        return np.asarray(recording.cache[key])
    model = relation.gain * np.gradient(relation.expected, recording.step)
    missed = np.gradient(recording.even(relation.output), recording.step) - model
    steps = _reference_steps(case, relation, early)
    # What the start excites more than all later steps together cannot be learned from them.
    strongest = float(np.max(np.sum(steps[:early] ** 2, axis=1)))
    powers, directions = np.linalg.eigh(steps[early:].T @ steps[early:])
    learned = directions[:, powers > strongest]
    answer = (learned.T @ (steps[early:].T @ missed[early:])) / powers[powers > strongest]
    recording.cache[key] = model + steps @ (learned @ answer)
    return np.asarray(recording.cache[key])


def _reference_steps(case: Case, relation: Relation, early: int) -> np.ndarray:
    """(M, references * lags): each reference's changes over the last `early` samples; before
    the first sample a drive at rest asks for no speed, and for the place where it stands."""
    width = -(-early // LAGS)
    columns = []
    for name in relation.inputs:
        reference = case.corrected.even(name)
        before = 0.0
        if role_of(name) is not Role.SPEED:
            before = case.corrected.even(name.removesuffix("_ref"))[0]
        for late in range(0, early, width):
            then = np.r_[np.full(late + width, before), reference]
            columns.append(then[width : width + len(reference)] - then[: len(reference)])
    return np.column_stack(columns)


def _block_means(q: np.ndarray) -> np.ndarray:
    return np.asarray(q[: len(q) // FIRST * FIRST].reshape(-1, FIRST).mean(axis=1))


def _from_rest(case: Case, name: str) -> np.ndarray | None:
    """What the loop makes of the references from a start at rest; None where that is not known."""
    loops = [
        r for r in case.dynamics.relations
        if r.output == name and r.inputs != (f"{name}_ref",) and len(r.inputs) > 1
    ]  # fmt: skip
    if not loops or loops[0].expected is None:
        return None
    rate, step = _rate_from_rest(case, loops[0]), case.corrected.step
    return np.append(0.0, np.cumsum(0.5 * step * (rate[1:] + rate[:-1])))
