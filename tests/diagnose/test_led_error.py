"""What an arm that is led along its encoders misses of itself needs no truth to be found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from core.diagnose import led_error as module
from core.diagnose.floor import channel_floors
from core.diagnose.led_error import led_error
from core.identify.predictor import Motion, motion_of
from core.identify.prepared import Prepared, make_task
from tests.identify.test_switching_torque import FACTOR, RARELY, STEP, missing, prepared, rms

SELDOM = 1.6 * RARELY
"""s: the link swings by 2.6 rad from one sample to the next."""

AGREE = 0.2
"""Relative, of the error's rms: a floor is known within a factor of 1.5."""

STIFFER = 1.01
"""Of the true stiffness: where a fit may end that looks through such samples."""

FAR_OFF = 40.0
"""Times the torque: the joint leaves its way by more than the way is long within half a second."""

NOTHING = 2e-3
"""Of the torque: below it nothing shows on a rig whose samples show the vibration."""


def at(e: Prepared, stiffness: float = 1.0) -> Motion:
    values = {"EI1": stiffness * e.model.arm.segments[0].EI}
    numbers = e.model.numbers(values)
    return motion_of(e, numbers, values, 4), numbers, values


def found(e: Prepared, stiffness: float = 1.0) -> np.ndarray:
    error = led_error(e, at(e, stiffness))
    assert error is not None
    return error[e.counted]


@pytest.mark.parametrize("step", [RARELY, SELDOM])
def test_it_is_as_large_as_what_the_true_model_leaves(step: float) -> None:
    e = prepared(0.0, step=step)
    assert rms(found(e)) == pytest.approx(rms(missing(e)), rel=AGREE)


def test_sample_by_sample_it_is_what_the_true_model_leaves() -> None:
    e = prepared(0.0, step=SELDOM)
    assert rms(found(e) - missing(e)) < AGREE * rms(missing(e))


def test_a_stiffness_that_is_a_little_off_tells_its_size_as_well() -> None:
    e = prepared(0.0, step=SELDOM)
    assert 1.0 / FACTOR < rms(found(e, STIFFER)) / rms(missing(e)) < FACTOR


def test_there_is_nearly_none_where_samples_show_the_vibration() -> None:
    e = prepared(0.0, step=STEP)
    assert rms(found(e)) < NOTHING * rms(e.measured)


def test_a_complete_model_stays_within_a_floor_that_counts_it() -> None:
    e = prepared(0.0, step=SELDOM)
    error = np.where(e.counted, -missing_block(e), 0.0)
    (floor,) = channel_floors([e], [error], [at(e)], {"theta1": 1e-9, "u1": 1e-9}, 1e-3).values()
    assert floor.noise < 0.1 * rms(missing(e)) < rms(missing(e)) < (1.0 + AGREE) * floor.value


def missing_block(e: Prepared) -> np.ndarray:
    motion, numbers, values = at(e)
    return e.predicted(motion, numbers, values) - e.measured


def test_a_model_that_torques_move_elsewhere_tells_nothing() -> None:
    e = prepared(0.0, step=SELDOM)
    torques = {"u1": FAR_OFF * e.recording.channels["u1"]}
    recording = replace(e.recording, channels={**e.recording.channels, **torques})
    far = replace(e, recording=recording, task=make_task(e.model, recording))
    assert led_error(far, at(e)) is None


def test_what_is_not_finite_tells_nothing(monkeypatch) -> None:
    e = prepared(0.0, step=SELDOM)
    lost = motion_of(e, e.model.numbers(), {}, 4)
    lost = replace(lost, q=np.full_like(lost.q, np.nan))
    monkeypatch.setattr(module, "motion_of", lambda *_: lost)
    assert led_error(e, at(e)) is None


def test_an_arm_that_nothing_leads_has_none() -> None:
    e = prepared(0.0)
    assert led_error(replace(e, model=e.model.steered_by(None)), at(e)) is None
