"""How noise of recorded columns propagates to the compared outputs.

If a recording begins in motion, its first joint speeds come from the first samples. Their noise and
spline error make the arm vibrate to the end. A fit that estimates the first state removes that, so
it is no part of a noise floor; floors were thirty times too high.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..arm.arm import Arm
from ..identify.first_states import START
from ..identify.predictor import motion_of
from ..identify.prepared_recording import Prepared, make_task, measured_outputs
from ..identify.prescribed_joint_forces import servo_points_per_sample
from ..identify.processing import TORQUE
from ..model import Numbers
from ..noise.sensor_noise import ColumnNoise, is_command, quieter_of
from ..recording.channels import DRIVES, Role, role_of
from ..recording.recording import Recording, apply_logger_filter
from ..recording.velocity import ZeroPhaseLowPass
from ..sensors import sensor, sensors
from ..sensors.sensor import Sensor
from ..trajectory import Trajectory

ENCODER = "encoder"

DRAWS = 8
"""Draws of the noise per recording: with a filter of 10 Hz and one second the rms is good to a
tenth."""

SERVO_DRAWS = 6
"""The same with a virtual servo, where each draw is a simulation. Encoder noise excites lightly
damped links; single draws scatter by a quarter."""

MOST_REDRAWS = 20
"""Redraws until a draw begins at rest or in motion as the recording does; most do at once."""

SERVO_SUBSTEPS = 2
"""Steps per sample: both passes are alike, and only their difference counts."""

SERVO_NOISE_BAND = 4.0
"""Times the servo's frequency: above it the servo torque is encoder noise."""

DRAWS_SEED = 20
"""Seed of the draws: a noise floor must be reproducible."""

LEAST_LOGGER_GAIN = 0.1
"""Gain of a logger's filter below which nothing of the sensor's noise remains."""


@dataclass(frozen=True)
class NoisePath:
    """The path from a recording's columns to the outputs of an experiment."""

    experiment: Prepared
    trajectory: Trajectory
    numbers: Numbers
    values: Mapping[str, float]

    @property
    def recording(self) -> Recording:
        """The recording."""
        return self.experiment.recording

    @property
    def arm(self) -> Arm:
        """The arm of the model."""
        return self.experiment.model.arm

    @property
    def outputs(self) -> tuple[Sensor, ...]:
        """The compared sensors."""
        return self.experiment.outputs

    @property
    def servo_driven(self) -> bool:
        """Whether a virtual servo prescribes the measured joint motion."""
        return self.experiment.model.steering is not None

    @property
    def references(self) -> tuple[str, ...]:
        """The columns that drive the arm."""
        model = self.experiment.model
        return model.drive.reference_channels(model.arm)

    @property
    def places(self) -> list[str]:
        """The columns of the encoders."""
        return [f"theta{k + 1}" for k in range(self.experiment.model.arm.joints)]

    def source_columns(self, s: Sensor) -> tuple[str, ...]:
        """The noisy columns that an output is computed from; with a virtual servo also the
        encoders."""
        joints = self.places if self.servo_driven else []
        if s.kind == TORQUE and self.servo_driven:
            own = [n for n in self.references if role_of(n) in DRIVES]
        elif s.direct(self.recording, self.arm):
            own = [c.name for c in s.channels(self.arm)]
        else:  # angles and velocities of the rigid arm come from the camera
            own = ["z1", "z2"]
        return tuple(dict.fromkeys([*own, *joints]))

    def is_commanded(self, name: str) -> bool:
        """Whether a drive column is a command, which has no noise."""
        return name in self.references and is_command(self.recording[name])

    def stated(self, name: str, stated: Mapping[str, float]) -> float | None:
        """Stated standard deviation of a column's noise; that of a current follows from its
        torque."""
        if name in stated:
            return stated[name]
        torque = stated.get(f"u{name[1:]}") if role_of(name) is Role.CURRENT else None
        return None if torque is None else torque / self._constant(name)

    def _constant(self, name: str) -> float:
        """N m per unit of a column that drives the arm."""
        return float(np.abs(self._share_of(name)).max()) or 1.0

    def _share_of(self, name: str) -> np.ndarray:
        """(joints,) torque per unit of a column that drives the arm."""
        law = self.experiment.model.drive.law(self.arm, self.trajectory.p, self.values)
        return law.R[:, self.references.index(name)]

    def noise_free(self, name: str) -> np.ndarray | None:
        """(N,) the column by the model, without noise; None if the model has none."""
        e, arm = self.experiment, self.arm
        if self.servo_driven and name in self.references:
            return self._needed_torque(name)
        for kind, s in sensors().items():
            names = [c.name for c in s.channels(arm)]
            if name not in names or (kind in ("y", "ydot") and not arm.two_revolute):
                continue
            y = np.array(s.measure(self.trajectory))
            # Under a servo the model's joints are the encoders', noise and all.
            if self.servo_driven and kind == ENCODER:
                y = e.model.servo.response(y, self.recording.sample_time)
            y = e.sensed_by(kind, y, self.values)
            return self._logged(name, y[:, names.index(name)])
        return None

    def _needed_torque(self, name: str) -> np.ndarray:
        """(N,) torque that the measured motion needs, without encoder noise."""
        e, dt = self.experiment, self.recording.sample_time
        measured = e.sensed(sensor(TORQUE), self.trajectory, self.numbers, self.values)
        # A drive may have no column for a joint whose motion alone is known.
        torque = measured[:, int(np.argmax(np.abs(self._share_of(name))))]
        wide = min(SERVO_NOISE_BAND * e.model.servo.hz, 0.4 / dt)
        return ZeroPhaseLowPass(cutoff_hz=wide).apply(torque, dt) / self._constant(name)

    def _logged(self, name: str, x: np.ndarray) -> np.ndarray:
        logger = self.recording.logger_filters.get(name)
        if logger is None or not np.isfinite(x).all():
            return x
        return apply_logger_filter(x, self.recording.sample_time, logger)

    def logger_band(self, name: str) -> float:
        """rad per sample up to which a logger's filter passes the sensor's noise."""
        logger = self.recording.logger_filters.get(name)
        if logger is None:
            return np.pi
        w = np.linspace(1e-3, np.pi, 512) / self.recording.sample_time
        gain = logger.frequency**2 / np.abs(
            logger.frequency**2 - w**2 + 2j * logger.damping * logger.frequency * w
        )
        return float((w[gain > LEAST_LOGGER_GAIN] * self.recording.sample_time).max(initial=1e-3))

    def residual_stretches(self, name: str, undo: bool = True) -> list[np.ndarray]:
        """Evenly sampled stretches of the column minus the model, or of the column itself if that
        has less power at high frequencies; `undo`: inverts a logger's filter."""
        column = self.recording[name]
        model = self.noise_free(name)
        residual = column if model is None else column - model
        sampled = np.flatnonzero(np.isfinite(residual) & self.recording.mask(name))
        if not sampled.size:
            return []
        distance = np.diff(sampled)
        stride = int(np.median(distance)) if distance.size else 1
        runs = np.split(sampled, np.flatnonzero(distance != stride) + 1)
        stretches = [quieter_of(residual[run], column[run]) for run in runs]
        return [self._unlogged(name, x) for x in stretches] if undo else stretches

    def _unlogged(self, name: str, x: np.ndarray) -> np.ndarray:
        """The stretch divided by the gain of the logger's filter, where that passes something."""
        logger = self.recording.logger_filters.get(name)
        if logger is None:
            return x
        impulse = np.zeros(len(x))
        impulse[len(x) // 2] = 1.0
        answer = apply_logger_filter(impulse, self.recording.sample_time, logger)
        gain = np.maximum(np.abs(np.fft.rfft(answer)), LEAST_LOGGER_GAIN)
        window = np.fft.rfft(x - x.mean())
        return np.fft.irfft(window / gain, len(x))

    def noise(self, column_noise: Mapping[str, ColumnNoise], number: int) -> list[list[np.ndarray]]:
        """Per channel the draws of its noise, at the samples that count."""
        e = self.experiment
        drawn: list[list[np.ndarray]] = [[] for _ in e.channels]
        for difference in self.draws(column_noise, number):
            for column, counted, samples in zip(difference.T, e.counted.T, drawn, strict=True):
                samples.append(column[counted & np.isfinite(column)])
        return drawn

    def own_noise(self, column_noise: Mapping[str, ColumnNoise], number: int) -> list[np.ndarray]:
        """Draws (M, k) of the noise that the channels' own columns bring into the outputs, not
        through the motion."""
        rng = np.random.default_rng([DRAWS_SEED, number])
        through = self.places if self.servo_driven else []
        own = {n: x for n, x in column_noise.items() if n not in through}
        smooth = {n: self.noise_free(n) for n in own}
        plain = self._measured(self.recording)
        return [self._measured(self._noisy(own, smooth, rng)) - plain for _ in range(DRAWS)]

    def draws(
        self, column_noise: Mapping[str, ColumnNoise], number: int, least: int = 1
    ) -> Iterator[np.ndarray]:
        """Draws (M, k) of the noise in the outputs, at least `least`; `number` of the recording."""
        rng = np.random.default_rng([DRAWS_SEED, number])
        smooth = {
            n: self.noise_free(n) for s in self.experiment.outputs for n in self.source_columns(s)
        }
        plain = self._simulated_difference(self.recording)
        responses = self._initial_state_responses(plain)
        for _ in range(max(least, SERVO_DRAWS if self.servo_driven else DRAWS)):
            recording = self._draw_with_same_initial_motion(column_noise, smooth, rng)
            yield without_responses(self._simulated_difference(recording) - plain, responses)

    def _initial_state_responses(self, plain: np.ndarray) -> np.ndarray | None:
        """Responses to the first state; only a motion prescribed from noisy encoders needs them."""
        if not self.servo_driven:
            return None

        def compared(values: Mapping[str, float]) -> np.ndarray:
            return replace(self, values=values)._simulated_difference(self.recording)

        return initial_state_responses(self.values, plain, compared)

    def _draw_with_same_initial_motion(
        self, column_noise: Mapping[str, ColumnNoise], smooth: Mapping[str, np.ndarray | None],
        rng: np.random.Generator,
    ) -> Recording:  # fmt: skip
        """A draw that begins at rest or in motion as the recording does: a first speed read from
        noise would excite the arm all the time."""
        for _ in range(MOST_REDRAWS):
            drawn = self._noisy(column_noise, smooth, rng)
            if not self.servo_driven or self._at_rest(drawn) == self._at_rest(self.recording):
                break
        return drawn

    def _at_rest(self, recording: Recording) -> bool:
        return self.experiment.model.servo.motion(recording, self.arm).before is not None

    def _noisy(
        self, column_noise: Mapping[str, ColumnNoise], smooth: Mapping[str, np.ndarray | None],
        rng: np.random.Generator,
    ) -> Recording:  # fmt: skip
        channels = dict(self.recording.channels)
        for name, model in smooth.items():
            if name in column_noise and name in channels:
                noise = column_noise[name].drawn(rng, channels[name], model)
                own = noise if column_noise[name].after_logger else self._logged(name, noise)
                channels[name] = channels[name] + own
        return replace(self.recording, channels=channels)

    def _measured(self, recording: Recording) -> np.ndarray:
        """(M, k): the outputs of a recording, processed."""
        e = self.experiment
        columns = [measured_outputs(e.model, recording, s)[0] for s in e.outputs]
        return np.asarray(replace(e, recording=recording).processed(np.hstack(columns)))

    def _simulated_difference(self, recording: Recording) -> np.ndarray:
        """(M, k): measurement, minus the model's answer if a virtual servo prescribes the
        motion."""
        e, measured = self.experiment, self._measured(recording)
        if not self.servo_driven:
            return measured
        again = replace(e, recording=recording, task=make_task(e.model, recording))
        steps = max(SERVO_SUBSTEPS // servo_points_per_sample(e.model, recording.sample_time), 1)
        motion = motion_of(again, self.numbers, self.values, steps)
        difference = measured - again.predicted(motion, self.numbers, self.values)
        return e.standstill.removed_from(np.where(e.counted, difference, 0.0))


INITIAL_STATE_CHANGE = 1e-4
"""m or m/s at a tip: change of the first state, a thousandth of usual vibrations, so that the
response is linear."""

REWEIGHTINGS = 2
"""Weightings of the channels: by the error, then by its remainder."""


def initial_state_responses(
    values: Mapping[str, float],
    plain: np.ndarray,
    compared: Callable[[Mapping[str, float]], np.ndarray],
) -> np.ndarray | None:
    """(M, k, S): change of `compared` with each estimated number of the first state; `plain` (M, k)
    is its value at `values`. None if none is estimated."""
    names = [name for name in values if name.startswith(START)]
    if not names:
        return None
    changed = [compared({**values, n: values[n] + INITIAL_STATE_CHANGE}) - plain for n in names]
    return np.stack(changed, axis=-1)


def without_responses(error: np.ndarray, responses: np.ndarray | None) -> np.ndarray:
    """An error (M, k) minus the best combination of `responses` (M, k, S), each channel weighted by
    its remainder. NaN where nothing was measured."""
    if responses is None:
        return error
    finite = np.isfinite(error) & np.isfinite(responses).all(axis=-1)
    complete, columns = np.where(finite, error, 0.0), np.where(finite[..., None], responses, 0.0)
    residual = complete
    for _ in range(REWEIGHTINGS):
        sizes = np.sqrt(np.mean(residual**2, axis=0))
        weights = np.divide(1.0, sizes, out=np.zeros_like(sizes), where=sizes > 0.0)
        rows = (columns * weights[:, None]).reshape(complete.size, -1)
        sizes = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
        change = np.linalg.lstsq(rows / sizes, (complete * weights).ravel(), rcond=1e-9)[0] / sizes
        residual = complete - columns @ change
    return np.where(np.isfinite(error), residual, np.nan)
