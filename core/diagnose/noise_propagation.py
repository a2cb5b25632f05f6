"""From a recording's columns to the outputs of an experiment, and what noise becomes on the way.

Where a recording begins in motion, the speed of its joints comes from the first samples: their
noise, and what a spline misses there, makes the arm swing to the end. A fit that estimates the
first state takes that out, so it is no part of a noise floor; floors were thirty times too high.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..arm.arm import Arm
from ..diagnose.sensor_noise import ColumnNoise, is_command, quieter
from ..identify.held import points_led
from ..identify.predictor import motion_of
from ..identify.prepared import Prepared, make_task, measured_outputs
from ..identify.processing import TORQUE
from ..identify.unknowns import START
from ..model import Numbers
from ..recording.channels import DRIVES, Role, role_of
from ..recording.recording import Recording, apply_logger_filter
from ..recording.velocity import ZeroPhaseLowPass
from ..sensors import Sensor, sensor, sensors
from ..trajectory import Trajectory

ENCODER = "encoder"

DRAWS = 8
"""Of the noise per recording: with a filter of 10 Hz and one second the rms is good to a tenth."""

SERVO_DRAWS = 6
"""The same where a servo leads the joints, and each draw is a simulation: the encoders' noise
shakes lightly damped links, and what one draw says of them scatters by a quarter."""

TRIES = 20
"""Until a draw begins as the recording does; most do at once."""

SERVO_STEPS = 2
"""Per sample: both passes are alike, and only what the noise changes counts."""

WIDE_SERVO = 4.0
"""Times the servo's frequency: above it the torque that it makes is noise of the encoders."""

SEED = 20
"""Of the draws; a floor must not change from one look to the next."""

LOGGED_OUT = 0.1
"""Gain of a logger's filter below which nothing of the sensor's own is left."""


@dataclass(frozen=True)
class Route:
    """From a recording's columns to the outputs of an experiment."""

    experiment: Prepared
    trajectory: Trajectory
    numbers: Numbers
    values: Mapping[str, float]

    @property
    def recording(self) -> Recording:
        """What was measured."""
        return self.experiment.recording

    @property
    def arm(self) -> Arm:
        """Of the model that is compared."""
        return self.experiment.model.arm

    @property
    def outputs(self) -> tuple[Sensor, ...]:
        """What is compared."""
        return self.experiment.outputs

    @property
    def driven(self) -> bool:
        """Whether a virtual servo leads the joints along the encoders."""
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

    def followed(self, s: Sensor) -> bool:
        """Whether the output is the torque of a virtual servo."""
        return s.kind == TORQUE and self.driven

    def feeding(self, s: Sensor) -> tuple[str, ...]:
        """The noisy columns that an output comes from; under a servo the encoders always."""
        model = self.experiment.model
        joints = self.places if self.driven else []
        if self.followed(s):
            own = [n for n in model.drive.reference_channels(model.arm) if role_of(n) in DRIVES]
        elif s.direct(self.recording, model.arm):
            own = [c.name for c in s.channels(model.arm)]
        else:  # angles and velocities of the rigid arm come from the camera
            own = ["z1", "z2"]
        return tuple(dict.fromkeys([*own, *joints]))

    def commanded(self, name: str) -> bool:
        """Whether a column of the drive is what it was told, which has no noise."""
        model = self.experiment.model
        known = name in model.drive.reference_channels(model.arm)
        return known and is_command(self.recording[name])

    def stated(self, name: str, stated: Mapping[str, float]) -> float | None:
        """What is stated of a column; of a current by its torque."""
        if name in stated:
            return stated[name]
        torque = stated.get(f"u{name[1:]}") if role_of(name) is Role.CURRENT else None
        return None if torque is None else torque / self._constant(name)

    def _constant(self, name: str) -> float:
        """N m per unit of a column that drives the arm."""
        model = self.experiment.model
        place = model.drive.reference_channels(model.arm).index(name)
        law = model.drive.law(model.arm, self.trajectory.p, self.values)
        return float(np.abs(law.R[:, place]).max()) or 1.0

    def smooth(self, name: str) -> np.ndarray | None:
        """(N,) the column as the model has it; None where it has none."""
        e, arm = self.experiment, self.experiment.model.arm
        if self.driven and name in e.model.drive.reference_channels(arm):
            return self._needed(name)
        for kind, s in sensors().items():
            names = [c.name for c in s.channels(arm)]
            if name not in names or (kind in ("y", "ydot") and not arm.two_revolute):
                continue
            y = np.array(s.measure(self.trajectory))
            # Under a servo the model's joints are the encoders', noise and all.
            if self.driven and kind == ENCODER:
                y = e.model.servo.response(y, self.recording.sample_time)
            y = e.model.sensed(kind, y, self.recording.sample_time, self.values)
            return self._logged(name, y[:, names.index(name)])
        return None

    def _needed(self, name: str) -> np.ndarray:
        """(N,) of the torque that the measured motion needs, without the encoders' noise."""
        e, dt = self.experiment, self.recording.sample_time
        place = e.model.drive.reference_channels(e.model.arm).index(name)
        read = e.sensed(sensor(TORQUE), self.trajectory, self.numbers, self.values)
        # A drive may have no column for a joint whose motion alone is known.
        law = e.model.drive.law(e.model.arm, self.trajectory.p, self.values)
        torque = read[:, int(np.argmax(np.abs(law.R[:, place])))]
        wide = min(WIDE_SERVO * e.model.servo.hz, 0.4 / dt)
        return ZeroPhaseLowPass(cutoff_hz=wide).apply(torque, dt) / self._constant(name)

    def _logged(self, name: str, x: np.ndarray) -> np.ndarray:
        logger = self.recording.logger_filters.get(name)
        complete = np.isfinite(x).all()
        return (
            x
            if logger is None or not complete
            else apply_logger_filter(x, self.recording.sample_time, logger)
        )

    def logged_to(self, name: str) -> float:
        """rad per sample up to which a logger's filter lets the sensor's own noise through."""
        logger = self.recording.logger_filters.get(name)
        if logger is None:
            return np.pi
        w = np.linspace(1e-3, np.pi, 512) / self.recording.sample_time
        gain = logger.frequency**2 / np.abs(
            logger.frequency**2 - w**2 + 2j * logger.damping * logger.frequency * w
        )
        return float((w[gain > LOGGED_OUT] * self.recording.sample_time).max(initial=1e-3))

    def beyond_the_model(self, name: str, undo: bool = True) -> list[np.ndarray]:
        """Even stretches of what the column says beyond the model, or by itself where the model
        only adds to the high band; `undo`: a logger's filter."""
        column = self.recording[name]
        model = self.smooth(name)
        rest = column if model is None else column - model
        sampled = np.flatnonzero(np.isfinite(rest) & self.recording.mask(name))
        if not sampled.size:
            return []
        distance = np.diff(sampled)
        stride = int(np.median(distance)) if distance.size else 1
        runs = np.split(sampled, np.flatnonzero(distance != stride) + 1)
        found = [quieter(rest[run], column[run]) for run in runs]
        return [self._unlogged(name, x) for x in found] if undo else found

    def _unlogged(self, name: str, x: np.ndarray) -> np.ndarray:
        """Divided by the gain of the logger's filter, where that leaves something."""
        logger = self.recording.logger_filters.get(name)
        if logger is None:
            return x
        impulse = np.zeros(len(x))
        impulse[len(x) // 2] = 1.0
        answer = apply_logger_filter(impulse, self.recording.sample_time, logger)
        gain = np.maximum(np.abs(np.fft.rfft(answer)), LOGGED_OUT)
        window = np.fft.rfft(x - x.mean())
        return np.fft.irfft(window / gain, len(x))

    def noise(self, known: Mapping[str, ColumnNoise], number: int) -> list[list[np.ndarray]]:
        """Per channel the draws of its noise, of the samples that count."""
        e = self.experiment
        drawn: list[list[np.ndarray]] = [[] for _ in e.channels]
        for apart in self.draws(known, number):
            for column, counted, found in zip(apart.T, e.counted.T, drawn, strict=True):
                found.append(column[counted & np.isfinite(column)])
        return drawn

    def draws(
        self, known: Mapping[str, ColumnNoise], number: int, least: int = 1
    ) -> Iterator[np.ndarray]:
        """Draws (M, k) of what the columns' noise becomes, so many at least; `number` of the
        recording."""
        rng = np.random.default_rng([SEED, number])
        smooth = {n: self.smooth(n) for s in self.experiment.outputs for n in self.feeding(s)}
        plain = self._compared(self.recording)
        answers = self._of_first_state(plain)
        for _ in range(max(least, SERVO_DRAWS if self.driven else DRAWS)):
            drawn = self._compared(self._begun_alike(known, smooth, rng)) - plain
            yield without(drawn, answers)

    def _of_first_state(self, plain: np.ndarray) -> np.ndarray | None:
        """Only what is led through noise is shaken by its first samples."""
        if not self.driven:
            return None

        def compared(values: Mapping[str, float]) -> np.ndarray:
            return replace(self, values=values)._compared(self.recording)

        return answers_to(self.values, plain, compared)

    def _begun_alike(
        self,
        known: Mapping[str, ColumnNoise],
        smooth: Mapping[str, np.ndarray | None],
        rng: np.random.Generator,
    ) -> Recording:
        """A draw that is seen to begin at rest where the recording is, and to move where it does:
        a speed at the start that was read out of the noise would shake the arm all the time."""
        for _ in range(TRIES):
            drawn = self._noisy(known, smooth, rng)
            if not self.driven or self._at_rest(drawn) == self._at_rest(self.recording):
                break
        return drawn

    def _at_rest(self, recording: Recording) -> bool:
        return self.experiment.model.servo.places(recording, self.arm)[1] is not None

    def _noisy(
        self,
        known: Mapping[str, ColumnNoise],
        smooth: Mapping[str, np.ndarray | None],
        rng: np.random.Generator,
    ) -> Recording:
        channels = dict(self.recording.channels)
        for name, model in smooth.items():
            if name in known and name in channels:
                noise = known[name].drawn(rng, channels[name], model)
                own = noise if known[name].after_logger else self._logged(name, noise)
                channels[name] = channels[name] + own
        return replace(self.recording, channels=channels)

    def _compared(self, recording: Recording) -> np.ndarray:
        """(M, k): what is measured, less what the model answers where a servo leads it along."""
        e = self.experiment
        columns = [measured_outputs(e.model, recording, s)[0] for s in e.outputs]
        measured = replace(e, recording=recording).processed(np.hstack(columns))
        if not self.driven:
            return measured
        again = replace(e, recording=recording, task=make_task(e.model, recording))
        steps = max(SERVO_STEPS // points_led(e.model, recording.sample_time), 1)
        motion = motion_of(again, self.numbers, self.values, steps)
        return measured - again.predicted(motion, self.numbers, self.values)


SMALL = 1e-4
"""m or m/s at a tip, by which a first state is changed: a thousandth of what arms swing by, so that
what follows is in proportion."""

AGAIN = 2
"""Times that channels are weighed: by the shaken error, and by what is left of it."""


def answers_to(
    values: Mapping[str, float],
    plain: np.ndarray,
    compared: Callable[[Mapping[str, float]], np.ndarray],
) -> np.ndarray | None:
    """(M, k, S): how what is `compared` changes with each estimated number of the first state from
    what it is at some values, `plain` (M, k); None where none is estimated."""
    names = [name for name in values if name.startswith(START)]
    if not names:
        return None
    changed = [compared({**values, n: values[n] + SMALL}) - plain for n in names]
    return np.stack(changed, axis=-1)


def without(error: np.ndarray, answers: np.ndarray | None) -> np.ndarray:
    """An error (M, k) less what some combination of `answers` (M, k, S) explains of it, each
    channel weighed by what is left of it. NaN where nothing was measured, as before."""
    if answers is None:
        return error
    known = np.isfinite(error) & np.isfinite(answers).all(axis=-1)
    whole, columns = np.where(known, error, 0.0), np.where(known[..., None], answers, 0.0)
    left = whole
    for _ in range(AGAIN):
        sizes = np.sqrt(np.mean(left**2, axis=0))
        weights = np.divide(1.0, sizes, out=np.zeros_like(sizes), where=sizes > 0.0)
        rows = (columns * weights[:, None]).reshape(whole.size, -1)
        sizes = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
        change = np.linalg.lstsq(rows / sizes, (whole * weights).ravel(), rcond=1e-9)[0] / sizes
        left = whole - columns @ change
    return np.where(np.isfinite(error), left, np.nan)
