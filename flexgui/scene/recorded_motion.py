"""The motion of one recording: the model's, and postures that agree with what was measured.

A recording does not hold the modal coordinates, so they are reconstructed: of all bendings that
explain the measured link deflections or the measured tip, the one with the least bending energy.
For one mode per segment and two joints that is the only one; for more modes it is the shape that
a force at the tip gives, close to the first natural mode.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import numpy as np

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.chord import chord_matrix
from flexgui.core.arm.compiled import CompiledArm
from flexgui.core.arm.slots import gravity_slot
from flexgui.core.model import Model, Numbers
from flexgui.core.progress import Progress, Silent
from flexgui.core.recording.recording import Recording
from flexgui.core.scenario.data_folder import ConfinedFolder, Folder
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.core.trajectory import Trajectory
from flexgui.scene.arm_geometry import ArmGeometry

LARGEST_DEFLECTION = 0.09
"""Of the reach: so far the tip is drawn from where a stiff arm had it, at the most."""
FACTORS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
FRAMES = 400
"""Looked at; the bending swings slowly enough."""


def largest_deflection(arm: Arm, p: np.ndarray, q: np.ndarray) -> float:
    """m between the tip and that of a stiff arm with numbers p (np,), over postures q (N, n)."""
    if arm.coordinates == arm.joints or not len(q):
        return 0.0
    frames = q[:: max(len(q) // FRAMES, 1)]
    stiff = frames.copy()
    stiff[:, arm.joints :] = 0.0
    geometry = ArmGeometry(arm, p)
    return float(np.max(np.linalg.norm(geometry.tips(frames) - geometry.tips(stiff), axis=1)))


def fitting_factor(arm: Arm, p: np.ndarray, q: np.ndarray) -> float:
    """The factor among FACTORS that draws the largest deflection of an arm with numbers p (np,),
    over postures q (N, n), nearest to LARGEST_DEFLECTION of the reach."""
    bent = largest_deflection(arm, p, q)
    if not np.isfinite(bent) or bent <= 0.0:
        return FACTORS[0]
    ideal = LARGEST_DEFLECTION * ArmGeometry(arm, p).reach / bent
    limits = [np.sqrt(a * b) for a, b in pairwise(FACTORS)]
    return FACTORS[int(np.searchsorted(limits, ideal))]


FRAMES_PER_SECOND = 50.0
"""Frames kept per second of the recording; screens show 60, the eye asks for less."""

PIXEL = 1e-4
"""m, rms: error of a simulated motion that nobody sees."""


@dataclass(frozen=True)
class RecordedMotion:
    """K frames."""

    recording: str
    motion: Trajectory
    """Of the model; its time starts at zero."""
    ghost: np.ndarray | None
    """(K, n) measured postures; None where no encoder was recorded."""
    fitted: bool
    """Whether the model is the identified one."""

    @property
    def arm(self) -> Arm:
        """The arm that moves."""
        return self.motion.arm

    @cached_property
    def exaggeration(self) -> float:
        """How many times larger the bending is drawn where nobody has chosen."""
        return fitting_factor(self.arm, self.motion.p, self.motion.q)

    def exaggerated_ghost(self, times: float) -> np.ndarray | None:
        """(K, n) the measured postures, so many times farther from the model's."""
        if self.ghost is None or times == 1.0:
            return self.ghost
        return self.motion.q + times * (self.ghost - self.motion.q)

    def frame(self, time: float) -> int:
        """The frame at a time in s, clipped."""
        index = int(np.searchsorted(self.motion.time, time + 1e-9, side="right")) - 1
        return int(np.clip(index, 0, len(self.motion.time) - 1))

    @property
    def seconds(self) -> float:
        """Length of the motion, s."""
        return float(self.motion.time[-1])


def read_recording(
    scenario: Scenario,
    name: str,
    folder: Folder,
    data: Path | None = None,
    progress: Progress | None = None,
) -> Recording:
    """One recording of the scenario, read from the folders or simulated."""
    from flexgui.core.loading import load_recordings

    chosen = tuple(spec for spec in scenario.recordings if spec.name == name)
    alone = scenario.model_copy(update={"recordings": chosen})
    return load_recordings(alone, base_model(scenario), folder, data, progress or Silent())[0]


def load_motion(
    scenario: Scenario, recording: str, folder: str, values: Mapping[str, float], *,
    progress: Progress,
) -> tuple[Recording, RecordedMotion]:  # fmt: skip
    """A recording and its motion, in a worker: a file of `folder` only; `values` are the fitted
    parameters, none where there is no fit."""
    read = read_recording(scenario, recording, ConfinedFolder(Path(folder)), progress=progress)
    return read, simulated_motion(scenario, values, read.rows(slice(0, MOST_PLAYED)))


MOST_PLAYED = 100_000
"""Samples of a recording that are simulated to be played: its beginning; all of it is fitted."""


def simulated_motion(
    scenario: Scenario, values: Mapping[str, float], recording: Recording
) -> RecordedMotion:
    """The model with parameters at `values`, the others as stated."""
    from flexgui.core.identify.prepared_recording import make_task
    from flexgui.core.identify.setup import make_setup
    from flexgui.core.simulate.linear import respond
    from flexgui.core.simulate.nonlinear import simulate_within

    # Only recordings to estimate from decide which outputs there are, and so the servo.
    chosen = [replace(recording, role="estimate")]
    model = make_setup(base_model(scenario), scenario.identify, chosen).model
    numbers = model.numbers(values)
    task = make_task(model, recording)
    if model.level == "lpv":
        motion = respond(model, [numbers], [task])[0]
    else:
        motion = simulate_within(model, numbers, task, PIXEL).trajectory
    stride = max(int(round(1.0 / (FRAMES_PER_SECOND * recording.sample_time))), 1)
    rows = slice(None, None, stride)
    parts = {name: getattr(motion, name)[rows] for name in ("q", "v", "torque")}
    frames = replace(motion, time=motion.time[rows] - motion.time[0], **parts)
    # Gaps of a slow camera are filled before, or none of its samples might be kept.
    channels = {
        name: filled(recording.time, values[:, None])[rows, 0]
        for name, values in recording.channels.items()
    }
    shortened = replace(recording, time=recording.time[rows], channels=channels, counted={})
    ghost = measured_postures(shortened, model, numbers)
    return RecordedMotion(recording.name, frames, ghost, bool(values))


NEWTON_STEPS = 5
"""Newton steps; the tip is nearly linear in the bending, so each takes two digits or more."""

REGULARISATION = 1e-3
"""Of the largest compliance seen at the tip. A bending that hardly moves the tip (along a straight
arm) is not read from it: the camera's noise would become a large bending. What moves the tip is
not touched, since each step takes the share that the one before has left."""


def measured_postures(recording: Recording, model: Model, numbers: Numbers) -> np.ndarray | None:
    """q (N, n) of a recording; None without encoders. Straight where nothing shows the bending.

    Between samples of a slow camera the bending runs straight in time.
    """
    arm = model.arm
    names = [f"theta{k + 1}" for k in range(arm.joints)]
    if not recording.has(*names):
        return None
    q = np.zeros((len(recording.time), arm.coordinates))
    q[:, : arm.joints] = np.column_stack([recording[name] for name in names])
    if arm.coordinates == arm.joints:
        return q
    flexibility = _flexibility(arm, model.compiled, numbers.p)
    _add_deflections(q, recording, arm, numbers.p, flexibility)
    if recording.has("z1", "z2"):
        z = np.column_stack([recording["z1"], recording["z2"]])
        _add_tip(q, recording.time, z, model.compiled, numbers.p, flexibility)
    return q


def _flexibility(arm: Arm, compiled: CompiledArm, p: np.ndarray) -> np.ndarray:
    """(n, n) inverse of the bending stiffness, zero for the joints."""
    without_gravity = p.copy()
    without_gravity[gravity_slot(arm.joints, 0) : gravity_slot(arm.joints, 2)] = 0.0
    K, _ = compiled.linear_matrices(np.zeros(arm.coordinates), without_gravity)
    out = np.zeros_like(K)
    out[arm.joints :, arm.joints :] = np.linalg.inv(K[arm.joints :, arm.joints :])
    return out


def _add_deflections(
    q: np.ndarray, recording: Recording, arm: Arm, p: np.ndarray, flexibility: np.ndarray
) -> None:
    """The least bending with the measured chord angle of each link that has a gauge."""
    for k, row in enumerate(chord_matrix(arm, p)):
        name = f"deflection{k + 1}"
        if not arm.modes[k] or not recording.has(name):
            continue
        shape = flexibility @ row
        q += filled(recording.time, recording[name][:, None]) * (shape / (row @ shape))


def _add_tip(
    q: np.ndarray,
    time: np.ndarray,
    z: np.ndarray,
    compiled: CompiledArm,
    p: np.ndarray,
    flexibility: np.ndarray,
) -> None:
    """Bends q (N, n) until its tips stand at z (N, 2)."""
    measured = np.flatnonzero(np.isfinite(z).all(axis=1))
    if not measured.size:
        return
    bent = q[measured]
    for _ in range(NEWTON_STEPS):
        tips, slopes = zip(*(compiled.tip_place(row, p) for row in bent), strict=True)
        miss, J = z[measured] - np.array(tips), np.array(slopes)
        yielding = J @ flexibility
        compliance = yielding @ np.swapaxes(J, 1, 2)
        size = np.trace(compliance, axis1=1, axis2=2)[:, None, None]
        pull = np.linalg.solve(compliance + REGULARISATION * size * np.eye(2), miss[:, :, None])
        bent = bent + (np.swapaxes(yielding, 1, 2) @ pull)[:, :, 0]
    change = np.full_like(q, np.nan)
    change[measured] = bent - q[measured]
    q += filled(time, change)


def filled(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Columns `values` (N, k) over `time` (N,) with NaN replaced by what runs straight between the
    samples around it."""
    finite = np.isfinite(values).all(axis=1)
    if finite.all():
        return values
    if not finite.any():
        return np.zeros_like(values)
    return np.column_stack([np.interp(time, time[finite], column[finite]) for column in values.T])
