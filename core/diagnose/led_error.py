"""What an arm that is led along its encoders misses of itself, where samples hardly show how it
swings.

Between the samples nobody knows where the joints were; splines go on as they went. Where the arm
swings by a radian and more from one sample to the next, that is wrong by some per cent of the
torque: an error of the comparison and of no effect, which repeats and which no noise explains. So
the model itself is moved by the recorded torques, sampled as the rig was, led along these samples
and compared with what it did.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from core.diagnose.first_state import answers_to, without
from core.drives.servo import held
from core.identify.guide import is_guided, keeping, kept, steps_between, torques
from core.identify.held import points_led, simulated_part
from core.identify.led_motion import joint_servo
from core.identify.led_points import finer_by
from core.identify.predictor import Motion, motion_of, on_all_cores, quick_handover
from core.identify.prepared import Prepared, make_task
from core.identify.prescribed import is_prescribed
from core.model import Numbers
from core.simulate.many import Job, run_many_extrapolated
from core.trajectory import Trajectory

STEP = 2.5e-4
"""s: a fiftieth of a period at 80 Hz; steps are extrapolated."""


def led_errors(
    experiments: Sequence[Prepared], motions: Sequence[Motion]
) -> list[np.ndarray | None]:
    """Per recording what `led_error` finds."""
    with quick_handover():
        pairs = list(zip(experiments, motions, strict=True))
        return list(on_all_cores(lambda pair: led_error(*pair), pairs))


def led_error(e: Prepared, motion: Motion) -> np.ndarray | None:
    """(M, k): what a model that is led along its own samples misses in what is compared.

    Args:
        motion: of the experiment at a fitted model; its numbers and values count.

    Returns:
        None where no servo leads the arm, where nothing of it swings, and where the model is so far
        off that the torques move it elsewhere.
    """
    _, numbers, values = motion
    moving = simulated_part(e.model, numbers)._replace(beside=())
    dt = e.recording.sample_time
    n, joints = e.model.arm.coordinates, e.model.arm.joints
    if n == joints or not is_prescribed(e.model, moving):
        return None
    # What sensors and held joints do is the same on both sides; the arm stays as it is.
    plain = replace(e, model=replace(e.model, effects=()))
    true = _moved(plain, moving, values)
    recorded = plain.task_at(values).references[:, -2 * joints : -joints]
    if not _goes_along(true.q[:, :joints], recorded):
        return None
    places = {f"theta{k + 1}": true.q[:, k] for k in range(joints)}
    recording = replace(e.recording, channels={**e.recording.channels, **places})
    again = replace(plain, recording=recording, task=make_task(plain.model, recording))
    steps = max(round(dt / STEP / points_led(e.model, dt)), 1)

    def led(values: Mapping[str, float]) -> np.ndarray:
        return again.predicted(motion_of(again, moving, values, steps), moving, values)

    compared = led(values)
    missed = compared - again.predicted(true, moving, values)
    missed = without(missed, answers_to(values, compared, led))
    return missed if np.isfinite(missed[e.counted]).all() else None


def _goes_along(moved: np.ndarray, recorded: np.ndarray) -> bool:
    """Whether joints (M, joints) stay nearer to the recorded ones than these travelled: another
    motion swings by other amounts, and its error says nothing about this one."""
    if not np.isfinite(moved).all():
        return False
    return bool(np.abs(moved - recorded).max() <= np.ptp(recorded, axis=0).max())


def _moved(e: Prepared, numbers: Numbers, values: Mapping[str, float]) -> Trajectory:
    """The model as the recorded torques move it, with the torque that the joints got."""
    model, task, servo = e.model, e.task_at(values), joint_servo(e.model)
    joints, dt = model.arm.joints, task.sample_time
    place = task.references[:, -2 * joints : -joints]
    smooth, stepping = torques(model, numbers, task)
    moved = replace(task, references=np.hstack([place, smooth, stepping]), before=None)
    job = Job(model, numbers._replace(law=keeping(servo, model.arm.coordinates)), moved)
    (true,) = run_many_extrapolated([job], _steps(e, dt))
    return replace(
        true, torque=held(stepping) + smooth + kept(servo, place - true.q[:, :joints], dt)
    )


def _steps(e: Prepared, dt: float) -> int:
    """Per sample."""
    if is_guided(e.model):
        return finer_by(e.model, dt) * steps_between(e.model, dt)
    return max(round(dt / STEP), 2)
