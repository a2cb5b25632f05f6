"""Joints that a virtual servo leads are prescribed; only what bends beyond them is simulated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from flexgui.core.arm.presets import presets
from flexgui.core.drives.servo import FollowingServo, hold_mean
from flexgui.core.drives.torque import Torque
from flexgui.core.effects import effect
from flexgui.core.effects.own import own_effect
from flexgui.core.effects.own_formula import own_parameter
from flexgui.core.identify.predictor import Predictor, job_of, motion_of
from flexgui.core.identify.prepared_recording import Prepared, prepare
from flexgui.core.identify.prescribed_joint_motion import points_per_sample, prescribed_motion
from flexgui.core.identify.prescribed_joints import is_prescribed
from flexgui.core.identify.processing import Processing
from flexgui.core.identify.unknowns import Unknowns
from flexgui.core.model import Model
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.velocity import ZeroPhaseLowPass
from flexgui.core.sensors import sensor
from flexgui.core.simulate.batch import run_many
from flexgui.core.simulate.nonlinear import simulate_within
from tests.helpers import chain, from_rest, read

BENCH = presets()["two_stage_bench"]
INERTIA = (0.35, 0.0095)
STEP, SAMPLES = 1e-3, 800
STIFF_HZ = 1e5
"""A servo that takes the joints along whatever they weigh."""

SIZES, RATES = np.array([0.15, 0.1]), np.array([4.0, 5.0])
"""rad, rad/s: of the joints' swings, which begin without an acceleration."""

FOLLOWS = 5e-4
"""Of the bending's size, against an independent integrator of high order: second differences at
1 ms miss that of the acceleration's changes, and the start is half a sample late."""

ONE_STEP = 1e-3
"""Of the torque's rms: what one step per sample leaves beside sixteen."""


def led(*effects: str, values: dict[str, float] | None = None, hz: float = STIFF_HZ) -> Prepared:
    """The bench with its joints led along smooth swings, its applied torque recorded as zero."""
    bare = Model(BENCH, Torque(), "nonlinear")
    model = bare.with_effects([effect(kind) for kind in effects], values)
    t = np.arange(SAMPLES) * STEP
    channels = {}
    for k in range(BENCH.joints):
        channels[f"theta{k + 1}"] = SIZES[k] * (1.0 - np.cos(RATES[k] * t)) ** 2
        channels[f"u{k + 1}"] = np.zeros_like(t)
    steered = model.steered_by(FollowingServo(model.drive, hz, INERTIA))
    return prepare(steered, Recording("r", t, channels), [sensor("torque")], Processing())


def motion(e: Prepared, steps: int = 16):  # type: ignore[no-untyped-def]
    found = Predictor([e], Unknowns(()), {}, steps=steps).trajectories([(np.zeros(0), [0])])
    return found[0][0][0]


def test_what_bends_is_what_an_independent_integrator_finds() -> None:
    e = led()
    arm, p = e.model.arm, e.model.numbers().p
    n, nj = arm.coordinates, arm.joints
    t = e.task.time

    def joints(at: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        w, c, s = RATES, np.cos(RATES * at), np.sin(RATES * at)
        speed, a = 2.0 * (1.0 - c) * w * s, 2.0 * w * w * (s * s + (1.0 - c) * c)
        return SIZES * (1.0 - c) ** 2, SIZES * speed, SIZES * a

    def rate(at: float, y: np.ndarray) -> np.ndarray:
        place, speed, a = joints(at)
        q, v = np.concatenate([place, y[: n - nj]]), np.concatenate([speed, y[n - nj :]])
        M, f = e.model.compiled.mass_and_force(q, v, p)
        return np.concatenate([y[n - nj :], np.linalg.solve(M[nj:, nj:], f[nj:] - M[nj:, :nj] @ a)])

    exact = solve_ivp(
        rate, (0.0, t[-1]), np.zeros(2 * (n - nj)), "Radau", t, rtol=1e-8, atol=1e-11
    ).y[: n - nj].T  # fmt: skip
    found = motion(e).q[:, nj:]
    assert np.abs(found[:-2] - exact[:-2]).max() < FOLLOWS * np.abs(exact).max()


def test_the_torque_balances_the_equations_of_motion() -> None:
    """M q'' - f with q'' by differences of the speeds found, at the joints and beyond."""
    e = led()
    found = motion(e)
    a = np.gradient(found.v, STEP, axis=0)
    needed = np.empty((SAMPLES, BENCH.joints))
    for k in range(SAMPLES):
        M, f = e.model.compiled.mass_and_force(found.q[k], found.v[k], found.p)
        needed[k] = (M @ a[k] - f)[: BENCH.joints]
    inner = slice(50, -50)
    apart = np.abs(found.torque - needed)[inner].max(axis=0)
    assert np.all(apart < 0.02 * np.abs(needed[inner]).max(axis=0))


@pytest.mark.parametrize(
    ("kind", "values"),
    [("joint_elasticity", {"c1": 1e-3, "c2": 2e-3}), ("tip_payload", {"mp": 0.05})],
)
def test_one_step_per_sample_is_enough(kind: str, values: dict[str, float]) -> None:
    e = led(kind, values=values, hz=60.0)
    coarse, fine = motion(e, 1).torque, motion(e, 16).torque
    rms = np.sqrt(np.mean((coarse - fine) ** 2, axis=0) / np.mean(fine**2, axis=0))
    assert np.all(rms < ONE_STEP)


def test_the_joints_go_where_the_servo_leads_them_whatever_rubs() -> None:
    e = led("viscous_friction", values={"fv1": 5.0, "fv2": 1.0}, hz=60.0)
    led_along = prescribed_motion(e.model, e.model.numbers(), e.task)
    lead, finer = led_along.lead, led_along.finer
    place, speed = led_along.place[::finer], led_along.speed[::finer]
    found = motion(e)
    assert np.array_equal(found.joint_positions, place[lead:])
    assert np.array_equal(found.v[:, : BENCH.joints], speed[lead:])


EARLY = 2.0
"""Times what the same noise in the middle makes; where the spline was free to have a speed at the
start, it was 3.3 times as much here, and 20 times on a rig of three links."""


def test_noise_where_a_motion_sets_out_shakes_the_arm_no_more_than_later_on() -> None:
    """A motion from rest has no speed at its first sample, whatever the next one says."""
    smooth = led()
    noise, rng = 1e-6, np.random.default_rng(1)
    draws = noise * rng.standard_normal((12, 8, BENCH.joints))

    def shaken(first: int) -> float:
        made = []
        for draw in draws:
            channels = dict(smooth.recording.channels)
            for k in range(BENCH.joints):
                column = channels[f"theta{k + 1}"].copy()
                column[first : first + 8] += draw[:, k]
                channels[f"theta{k + 1}"] = column
            other = replace(smooth.recording, channels=channels)
            e = prepare(smooth.model, other, [sensor("torque")], Processing())
            assert e.task.before is not None
            made.append((motion(e, 2).q - plain)[400:, BENCH.joints :])
        return float(np.sqrt(np.mean(np.square(made))))

    plain = motion(smooth, 2).q
    assert shaken(1) < EARLY * shaken(200)


def test_a_drive_with_a_limit_is_simulated_with_its_servo() -> None:
    e = led()
    numbers = e.model.numbers()
    limited = numbers._replace(law=numbers.law.__class__(**{
        **numbers.law.__dict__, "limit": np.array([1.0, 1.0])
    }))  # fmt: skip
    assert is_prescribed(e.model, numbers) and not is_prescribed(e.model, limited)
    assert job_of(e.model, limited, e.task).finish is None


def test_what_a_flexible_arm_lacks_hardly_depends_on_the_servo() -> None:
    """Slow motion: the missing torque, all of it here, passes servos of any frequency."""
    slow, stiff = motion(led(hz=20.0)), motion(led())
    inner = slice(100, -100)
    for k in range(BENCH.joints):
        apart = slow.torque[inner, k] - stiff.torque[inner, k]
        assert np.sqrt(np.mean(apart**2)) < 0.05 * np.sqrt(np.mean(stiff.torque[inner, k] ** 2))


def test_jobs_of_all_parameters_share_their_lanes() -> None:
    e = led()
    one = job_of(e.model, e.model.numbers(), e.task)
    other = job_of(e.model, e.model.numbers({"EI1": 2.0}), e.task)
    together = run_many([one, other], 2)
    for job, found in zip((one, other), together, strict=True):
        alone = run_many([job], 2)[0]
        assert np.abs(found.torque - alone.torque).max() < 1e-8 * np.abs(alone.torque).max()


ONE_STEP = 1e-4
"""Of the torque's largest value: what one step between two points misses."""


def test_one_step_between_the_points_of_a_prescribed_motion_is_enough() -> None:
    """A motion runs straight there, which a step's matrix holds."""
    e = led(hz=60.0)
    job = job_of(e.model, e.model.numbers(), e.task)
    exact, found = run_many([job], 64)[0].torque, run_many([job], 1)[0].torque
    assert np.abs(found - exact).max() < ONE_STEP * np.abs(exact).max()


def test_models_that_are_compared_are_led_along_the_same_points() -> None:
    """Or one of them would win by its steps."""
    bare = Model(BENCH, Torque(), "nonlinear")
    soft = bare.with_effects([effect("joint_elasticity")], {"c1": 1e-3, "c2": 2e-3})
    stiff = bare.with_effects([effect("extra_bending_mode")], {})
    for model in (soft, stiff):
        assert model.arm.coordinates > BENCH.coordinates
        assert points_per_sample(model, STEP) == points_per_sample(bare, STEP)


def test_an_encoder_with_a_hole_gives_no_numbers_and_no_traceback() -> None:
    e = led()
    e.task.references[400, -2 * BENCH.joints] = np.nan
    assert np.isnan(motion(e).torque).all()


SLOW = 0.02
"""Of the torque: the link follows a force that grows over half a second with a small vibration."""


def test_a_force_at_the_tip_over_time_is_held_by_the_joint() -> None:
    arm, size = chain(1), 4.0
    time = np.arange(500) * 1e-3
    recording = Recording("r", time, {"u1": 0.0 * time, "theta1": 0.0 * time})
    plain = Model(arm, Torque(), "nonlinear").steered_by(FollowingServo(Torque(), 60.0, (0.3,)))
    push = own_effect(arm, "tip2", "a*t", (own_parameter("a", size),), "own_1")
    model = plain.with_effects([push])
    e = prepare(model, recording, [sensor("torque")], Processing())
    torque = motion_of(e, model.numbers(), {}, 8).torque[:, 0]
    held = -size * time * arm.segments[0].length
    assert np.sqrt(np.mean((torque - held) ** 2)) < SLOW * np.abs(held).max()


LONGER = 1200

TORQUE = 0.05
"""Of the torque's rms: what was before the first sample is not known, and a filter of 40 Hz brings
it into the recording; 0.01 from 80 Hz on."""

BENDING = 1e-3
"""Of the deflections' rms; a start that was half a sample late left a fifth."""


def pushed() -> Recording:
    """The bench under torques that jump, held by their drive from sample to sample."""
    model = Model(BENCH, Torque(), "nonlinear")
    rng = np.random.default_rng(3)
    levels = rng.choice([-1.0, 1.0], (LONGER // 66 + 1, 2)) * np.array([1.0, 0.05])
    torque = np.repeat(levels, 66, axis=0)[:LONGER]
    task = from_rest(model, [0.2, -0.4], torque, STEP)
    motion = simulate_within(model, model.numbers(), task, 1e-9).trajectory
    return read(model, task, motion, "encoder", "deflection")


def missing(cutoff: float | None) -> tuple[Prepared, np.ndarray]:
    """What is compared, and its error over the rms of what was measured, per channel."""
    one = None if cutoff is None else ZeroPhaseLowPass(cutoff_hz=cutoff)
    servo = FollowingServo(Torque(), 60.0, INERTIA)
    model = Model(BENCH, Torque(), "nonlinear").steered_by(servo)
    outputs = [sensor("torque"), sensor("deflection")]
    e = prepare(model, pushed(), outputs, Processing(one))
    found = e.predicted(motion_of(e, model.numbers(), {}, 4), model.numbers(), {})
    apart = np.where(e.counted, found - e.measured, 0.0)
    return e, np.sqrt(np.mean(apart**2, axis=0) / np.mean(e.measured**2, axis=0))


@pytest.mark.parametrize("cutoff", [None, 40.0, 80.0])
def test_a_torque_rig_that_is_the_model_lacks_nothing(cutoff: float | None) -> None:
    e, error = missing(cutoff)
    assert e.task.before is not None
    assert np.all(error[:2] < TORQUE)
    assert np.all(error[2:] < BENDING)


def test_a_held_signal_is_seen_half_a_sample_late() -> None:
    ramp = np.arange(6.0)[:, None]
    assert hold_mean(ramp)[1:, 0] == pytest.approx(ramp[1:, 0] - 0.5)
    assert hold_mean(np.full((4, 1), 2.0)) == pytest.approx(2.0)
