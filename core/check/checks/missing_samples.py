"""Empty cells and rows, zeros between values, and channels that freeze."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...check.case import Case
from ...check.comparison import MOVES
from ...check.finding import RESAMPLE_LINE, Check, Finding
from ...check.measured_recording import MeasuredRecording
from ...check.signals import LONGEST_CONSTANT_RUN, OF_SPREAD, breaks_off
from ...noise.sensor_noise import common_quantisation_step
from ...recording.channels import DRIVES, Role, is_reference, joint_of, role_of
from ...recording.resampling import GAP
from ...recording.spec import GapsSpec


class Dropouts(Check):
    """Empty cells, missing rows, and zeros between values."""

    kind = "dropouts"

    def find(self, case: Case) -> Iterable[Finding]:
        recording = case.recording
        steps = np.diff(recording.time[np.isfinite(recording.time)])
        stuck = np.r_[False, steps[:-1] <= 0]  # a stamp that repeats makes the next step longer
        gaps = steps[(steps > GAP * recording.step) & ~stuck]
        if gaps.size and gaps.size < 0.1 * len(steps):
            missing = int(np.sum(np.round(gaps / recording.step) - 1))
            longest = f"{gaps.max():.4g} s"
            sentence = (
                f"{missing} rows are missing in {gaps.size} gaps of t; the longest is {longest}"
            )
            fix = _fix_lines(float(gaps.max()))
            yield case.finding(self.kind, "t", missing, "samples", sentence, fix)
        for name, values in recording.channels.items():
            missing = _missing(recording.counted(name), name in recording.masks) + _zeros(values)
            if missing:
                sentence = f"{name} has {missing} inner rows without a sample"
                yield case.finding(self.kind, name, missing, "samples", sentence)
            if held := int(np.sum(recording.held(name))):
                sentence = f"{name} repeats its last sample in {held} rows; leave those cells empty"
                yield case.finding(self.kind, name, held, "samples", sentence)


def _fix_lines(longest: float) -> str:
    """Lines that put the rows on an even clock; across a long gap nobody knows what was asked of
    the arm, so the longest part is kept."""
    how = "mask" if longest <= GapsSpec(how="mask").longest else "cut"
    return f'{RESAMPLE_LINE}\ngaps = {{ how = "{how}" }}'


def _missing(values: np.ndarray, masked: bool) -> int:
    """Empty cells beyond those of a slower sensor's own rate."""
    good = np.flatnonzero(np.isfinite(values))
    if len(good) < 10 or masked:
        return 0
    strides = np.diff(good)
    usual = int(np.median(strides))
    ends = int(good[0] // usual + (len(values) - 1 - good[-1]) // usual)
    return int(np.sum(np.round(strides[strides > usual] / usual) - 1)) + ends


def _zeros(values: np.ndarray) -> int:
    """Runs of exact zeros into which a channel falls from afar and from which it jumps back."""
    x = np.where(np.isfinite(values), values, 1.0)
    zero = np.flatnonzero(x == 0.0)
    if not 0 < len(zero) < 0.3 * len(x):
        return 0
    steps = np.abs(np.diff(x[x != 0.0]))
    moves = steps[steps > 0]
    usual = max(np.percentile(steps, 99), np.median(moves)) if moves.size else 0.0
    count = 0
    for run in np.split(zero, np.flatnonzero(np.diff(zero) > 1) + 1):
        if run[0] == 0 or run[-1] == len(x) - 1:
            continue
        before, after = abs(x[run[0] - 1]), abs(x[run[-1] + 1])
        jumps = min(before, after) > 5.0 * max(usual, 1e-12)
        count += len(run) if jumps and before * after > 0 else 0
    return count


LONGER = 4.0
"""Times the next longest run: an encoder at rest repeats values too, but more than once."""


class Dead(Check):
    """One value all the time, or for one long stretch while the others move."""

    kind = "dead"

    def find(self, case: Case) -> Iterable[Finding]:
        recording = case.recording
        for name in recording.channels:
            values = recording.counted(name)
            good = np.flatnonzero(np.isfinite(values))
            if len(good) < LONGEST_CONSTANT_RUN:
                continue
            x = values[good]
            if np.ptp(x) == 0.0:
                span = float(recording.time[good[-1]] - recording.time[good[0]])
                sentence = f"{name} is constant at {x[0]:g}"
                yield case.finding(self.kind, name, span, "s", sentence)
            elif not is_reference(name):  # a reference may stand still
                yield from self._frozen(case, name, good, x)

    def _frozen(self, case: Case, name: str, good: np.ndarray, x: np.ndarray) -> Iterable[Finding]:
        starts = np.flatnonzero(np.r_[True, np.diff(x) != 0.0])
        lengths = np.diff(np.r_[starts, len(x)])
        longest, second = np.sort(np.r_[lengths, 0])[:-3:-1]
        first = int(starts[np.argmax(lengths)])
        after, value = first + int(longest), x[first]
        if longest < max(LONGEST_CONSTANT_RUN, LONGER * second) or _clipped(x, value):
            return
        recording, rows = case.recording, slice(int(good[first]), int(good[after - 1]) + 1)
        breaks = role_of(name) not in FORCES and breaks_off(x, first, after)
        if not breaks and not _must_move(recording, name, rows):
            return
        begin, span = recording.time[rows.start], longest * recording.step
        sentence = f"{name} stays at {value:.6g} for {span:.4g} s from {begin:.4g} s"
        mask = f"mask = {{ {name} = [[{begin:.9g}, {begin + span:.9g}]] }}"
        yield case.finding(self.kind, name, span, "s", sentence, mask)


FORCES = (*DRIVES, Role.VOLTAGE, Role.KNOWN_TORQUE)
"""What no inertia keeps from breaking off."""


def _must_move(recording: MeasuredRecording, name: str, rows: slice) -> bool:
    """Whether what goes with a channel moves in some rows: the joint of a torque, the references of
    a joint, and while the other joints rest its torque and all that hangs on it."""
    joints = recording.names("theta#")
    of_joint = [n for n in recording.channels if joint_of(n) == joint_of(name) and n != name]
    forces = [n for n in of_joint if role_of(n) in FORCES]
    if role_of(name) in FORCES:
        joints = [n for n in joints if n in of_joint]
        return not joints or any(_moves(recording.counted(n), rows, MOVES) for n in joints)
    # What a coarse channel repeats, it may have seen.
    coarse = common_quantisation_step([recording.counted(name)]) > 0.0
    share = OF_SPREAD if coarse else MOVES
    if name not in joints:
        return any(_moves(recording.counted(n), rows, share) for n in joints)
    references = [n for n in of_joint if is_reference(n) and n not in forces]
    if any(_moves(recording.counted(n), rows, share) for n in references):
        return True
    if any(_moves(recording.counted(n), rows, MOVES) for n in joints):
        return False
    noisy = [recording.counted(n) for n in (*forces, *recording.names("z#", "deflection#"))]
    return any(np.nanstd(x[rows]) > OF_SPREAD * np.nanstd(x) for x in noisy)


def _moves(x: np.ndarray, rows: slice, share: float) -> bool:
    """Whether a channel (N,) moves in some rows by a share of its range."""
    return bool(np.ptp(x[rows]) > share * np.ptp(x[np.isfinite(x)]))


def _clipped(x: np.ndarray, value: float) -> bool:
    """A longest run at the top or the bottom that is not the only one there is a limit."""
    return bool(
        value in (x.max(), x.min()) and np.sum(np.diff(np.flatnonzero(x == value)) > 1) >= 2
    )
