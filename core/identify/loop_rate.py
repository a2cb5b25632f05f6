"""Whether a rig's loop runs faster than its recording: what its torques show.

A loop at the recording's rate holds each torque that it records until the next sample. A logger
that keeps one sample in ten writes the torque of its instant: half a sample of the recording
earlier. At 100 Hz that looks like a delay of 5 ms, or like viscous friction. Where nobody states it
([identify] torques_logged), the smaller error decides: it costs no parameter.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..drives.servo import FollowingServo
from ..identify.defect_correction import minimum_along
from ..identify.predictor import MotionCache
from ..identify.prepared_recording import for_model
from ..identify.processing import TORQUE
from ..identify.residuals import Residuals
from ..least_squares import bounds_and_prior, cost_of
from ..model import Model

FASTER_LOOP = (
    "The recorded torques fit better as values at their instants than as held until the next "
    "sample: the rig's loop seems to run faster than its recording."
)


def with_faster_loop(model: Model) -> Model:
    """The model, its torques as those of their instants: the safer start. Where they are held, each
    step of a noisy current shakes the links, by far too much while inertias are wrong."""
    servo = model.steering
    if servo is None or servo.faster_loop or servo.loop_stated:
        return model
    return model.steered_by(replace(servo, faster_loop=True))


def better_loop(residuals: Residuals, vector: np.ndarray) -> FollowingServo | None:
    """The virtual servo for the other rate of the loop, where it leaves less error near a `vector`
    (P,), once the unknowns have followed by a linear step: a friction that is fitted with the wrong
    rate makes up for a part of it. None where it does not, where it is stated how torques were
    logged, and where no torque is compared."""
    servo = residuals.experiments[0].model.steering
    if servo is None or servo.loop_stated or TORQUE not in residuals.experiments[0].kinds:
        return None
    other = replace(servo, faster_loop=not servo.faster_loop)
    before, after = (replace(r, anchor=None) for r in (residuals, with_servo(residuals, other)))
    slopes = after.slopes(vector, central=False)
    limits = bounds_and_prior(residuals.unknowns.parameters)
    end = minimum_along(slopes, after.blocks(vector), vector, limits)
    return other if end.cost < cost_of(before.blocks(vector)) else None


def with_servo(residuals: Residuals, servo: FollowingServo) -> Residuals:
    """The same recordings and weights with another virtual servo."""
    experiments = residuals.experiments
    models = {id(e.model): e.model.steered_by(servo) for e in experiments}
    others = [for_model(e, models[id(e.model)]) for e in experiments]
    predictor = replace(residuals.predictor, experiments=others, motion_cache=MotionCache())
    return replace(residuals, predictor=predictor, anchor=None)
