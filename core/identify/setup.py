"""The setup of an identification: outputs, servo, filters, and the notes that state them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..drives.servo import BEYOND, DEFAULT_HZ, FollowingServo
from ..errors import InputError
from ..identify.first_states import start_joints
from ..identify.prepared_recording import can_measure
from ..identify.prescribed_joint_motion import sampling_warning
from ..identify.processing import TORQUE, Processing
from ..identify.unknowns import starts_unknown
from ..model import Model
from ..recording.recording import Recording
from ..recording.velocity import ZeroPhaseLowPass
from ..recording.visible_band import visible_band
from ..scenario.schema import IdentifySpec
from ..sensors import sensor, sensors
from ..sensors.sensor import Sensor
from ..sentences import listed
from ..simulate.motion import at_rest

ENCODER = "encoder"

PREFERENCE = ("ydot", "z", "deflection", "encoder")
"""Default output: the first that all estimation recordings have and define. ydot is the paper's
stable output; y integrates, and z is right for any arm."""


def measured_sensors(model: Model, recordings: Sequence[Recording]) -> tuple[Sensor, ...]:
    """Sensors compared by default with the full equations: all direct measurements of which some
    recording has samples. Each is compared in the recordings that have it."""
    arm = model.arm
    return tuple(
        s for s in sensors().values()
        if s.primary and any(s.direct(r, arm) and can_measure(model, r, s) for r in recordings)
    )  # fmt: skip


@dataclass(frozen=True)
class Setup:
    """A model ready to be fitted, its compared outputs, processing, and notes."""

    model: Model
    outputs: tuple[Sensor, ...]
    processing: Processing
    notes: tuple[str, ...]


def make_setup(model: Model, spec: IdentifySpec, recordings: Sequence[Recording]) -> Setup:
    """The setup for the estimation recordings; InputError where they lack what is compared."""
    chosen = [r for r in recordings if r.role == "estimate"]
    if not chosen:
        raise InputError('No recording has role = "estimate"; give at least one that role.')
    outputs = _outputs(model, spec, chosen)
    processing = Processing(spec.filter or None, spec.decimate, spec.output_filter)
    servo, band = None, ""
    unknown = not model.drive.torque_known
    compared = any(s.kind == TORQUE for s in outputs)
    if spec.servo_hz is not None or unknown or compared:
        if compared and spec.filter is None and spec.output_filter is None:
            low_pass, band = torque_band(model.arm.joints, chosen)
            wide, beside = _motion_band(low_pass, model, outputs, chosen)
            processing = replace(processing, torque_filter=low_pass, motion_filter=wide)
            band = " ".join(sentence for sentence in (band, beside) if sentence)
        servo = _servo(model, spec, chosen, processing, [s.kind for s in outputs])
        model = model.steered_by(servo)
    notes = (*_notes(model, spec, outputs, chosen, servo), *([band] if band else []))
    return Setup(model, outputs, processing, notes)


def _outputs(
    model: Model, spec: IdentifySpec, recordings: Sequence[Recording]
) -> tuple[Sensor, ...]:
    if spec.output is not None:
        stated = tuple(sensor(kind) for kind in spec.output)
        for missing in (s for s in stated if not _shown_in(s, model, recordings)):
            missing.check(model.arm, recordings[0])
            missing.measured(recordings[0], model.arm)  # says which column is not there
        return _with_known_torque(model, stated)
    measured = measured_sensors(model, recordings)
    if _needs_servo(model):
        beside = [s for s in measured if s.kind != ENCODER]
        return _with_known_torque(model, (sensor(TORQUE), *beside), stated=False)
    if model.level == "nonlinear" and measured:
        return measured
    chosen, left = list[Sensor](), list(recordings)
    for candidate in map(sensor, PREFERENCE):
        showing = [r for r in left if _usable(candidate, model, r)]
        if showing:
            chosen.append(candidate)
            left = [r for r in left if r not in showing]
    if chosen and not left:
        return tuple(chosen)
    raise InputError(
        f"The recordings share none of the outputs {', '.join(PREFERENCE)}; add columns of a "
        f"camera, strain gauges or encoders, or state [identify] output."
    )


def _with_known_torque(
    model: Model, outputs: tuple[Sensor, ...], stated: bool = True
) -> tuple[Sensor, ...]:
    """The outputs without those that need a known torque."""
    if model.drive.torque_known:
        return outputs
    follows = {TORQUE, ENCODER}
    allowed = tuple(s for s in outputs if s.kind not in follows)
    if len(allowed) < len(outputs) and stated or not allowed:
        raise InputError(
            f"[drive] kind {model.drive.kind!r} knows no torque and prescribes the encoders' "
            f"motion, so neither can be compared. Add columns of a camera, strain gauges or "
            f"link-side encoders and compare those."
        )
    return allowed


BAND_PERIODS = 10.0
"""Least periods of the highest compared frequency within a recording."""

MOST_OF_RATE = 0.4
"""Share of the sampling rate above which a low-pass removes next to nothing."""


def torque_band(
    joints: int, recordings: Sequence[Recording]
) -> tuple[ZeroPhaseLowPass | None, str]:
    """The low-pass of torques along measured motions, and its sentence; None if the encoders show
    motion at nearly all frequencies of the slowest recording, or if recordings are too short."""
    bands = {}
    for k in range(joints):
        name = f"theta{k + 1}"
        band = visible_band([(r[name], r.sample_time) for r in recordings if r.has(name)])
        if band is not None:
            bands[name] = band
    if not bands or any(band.whole for band in bands.values()):
        return None, ""
    shortest = min(float(r.time[-1] - r.time[0]) for r in recordings)
    hz = max(max(band.hz for band in bands.values()), BAND_PERIODS / shortest)
    noises = ", ".join(f"{name} {band.noise:.1e}" for name, band in bands.items())
    if hz > MOST_OF_RATE / max(r.sample_time for r in recordings):
        return None, ""
    return ZeroPhaseLowPass(cutoff_hz=float(f"{hz:.3g}")), (
        f"Torques are compared up to {hz:.3g} Hz; above, the encoders show only noise ({noises} "
        f"rad or m). Set another band with [identify] filter = {{ cutoff_hz = ... }}, or none with "
        f"filter = false."
    )


def _motion_band(
    torques: ZeroPhaseLowPass | None, model: Model, outputs: Sequence[Sensor],
    recordings: Sequence[Recording],
) -> tuple[ZeroPhaseLowPass | None, str]:  # fmt: skip
    """The low-pass of outputs that follow from a prescribed motion, and its sentence; None if the
    torques have none, if there is no such output, or if a sensor is slower than the encoders.

    Beyond the encoders' band a joint moves as nobody recorded, and what the links do there no
    model can follow: a mode at 171 Hz left twice the noise in a camera of 500 Hz.
    """
    others = [s for s in outputs if s.kind != TORQUE]
    if torques is None or not others:
        return None, ""
    hz = BEYOND * torques.cutoff_hz
    columns = [x for s in others for r in recordings for x in s.measured(r, model.arm).T]
    slow = any(np.isfinite(x).any() and not np.isfinite(x).all() for x in columns)
    if slow or hz > MOST_OF_RATE / max(r.sample_time for r in recordings):
        return None, ""
    return ZeroPhaseLowPass(cutoff_hz=hz), f"All other outputs are compared up to {hz:.3g} Hz."


def _needs_servo(model: Model) -> bool:
    """Whether the recorded torque moves the arm without feedback: the model would drift away, so a
    virtual servo must follow the encoders."""
    law = model.drive.law(model.arm, model.numbers().p, {})
    return model.steering is None and not model.drive.holds_joints(law)


def _shown_in(output: Sensor, model: Model, recordings: Sequence[Recording]) -> list[Recording]:
    """The recordings that have samples of an output; all for a torque, which a servo may give."""
    return [r for r in recordings if output.kind == TORQUE or can_measure(model, r, output)]


def _usable(candidate: Sensor, model: Model, recording: Recording) -> bool:
    if not can_measure(model, recording, candidate):
        return False
    try:
        candidate.check(model.arm, recording)
    except InputError:
        return False
    return True


def _servo(
    model: Model, spec: IdentifySpec, recordings: Sequence[Recording], processing: Processing,
    kinds: Sequence[str],
) -> FollowingServo:  # fmt: skip
    """A servo with a double pole for the rigid inertia of each joint at the first posture."""
    n = model.arm.coordinates
    p = model.numbers().p
    posture = at_rest(start_joints(model, recordings[0]), n)[:n]
    inertia = np.diag(model.compiled.mass_matrix(posture, p))[: model.arm.joints]
    hz = spec.servo_hz or DEFAULT_HZ
    return model.drive.servo(
        model.drive, hz, tuple(float(x) for x in inertia), processing.band_hz(kinds),
        torque_hz=processing.band_hz([TORQUE]), faster_loop=spec.torques_logged == "at_instant",
        loop_stated=spec.torques_logged is not None,
    )  # fmt: skip


IN_MOTION = (
    "Nothing shows that the arm rests at the first samples, so the state in which a recording "
    "begins is estimated. If all begin at rest, set [identify] initial_state = false."
)
ANY_START = "The state in which each recording begins is estimated."


def _gaps(
    model: Model, outputs: Sequence[Sensor], recordings: Sequence[Recording]
) -> Iterator[str]:
    """Which of the outputs some recordings lack."""
    for s in outputs:
        showing = _shown_in(s, model, recordings)
        lacking = [r.name for r in recordings if r not in showing]
        if lacking:
            have = "has" if len(lacking) == 1 else "have"
            yield f"{s.kind} is not compared in {listed(lacking)}, which {have} no sample of it."


def _notes(
    model: Model, spec: IdentifySpec, outputs: Sequence[Sensor], recordings: Sequence[Recording],
    servo: FollowingServo | None,
) -> list[str]:  # fmt: skip
    stated = spec.output is not None
    names = ", ".join(f"{s.kind} ({s.title})" for s in outputs)
    sentences = [
        f"Compared output: {names}{'' if stated else ', the default for these recordings'}.",
        *_gaps(model, outputs, recordings),
    ]
    if model.level == "lpv":
        sentences.append(
            "Model level: linear parameter-varying, exact discretisation at each sample."
        )
    else:
        sentences.append("Model level: full non-linear simulation.")
    if any(s.kind == "ydot" and not s.direct(r, model.arm) for s in outputs for r in recordings):
        sentences.append(
            "ydot comes from tip positions by central differences, for measurement and model alike."
        )
    if spec.filter:
        sentences.append(f"Measurement and model passed the same filter. {spec.filter.sentence()}")
    if spec.output_filter is not None:
        sentences.append(
            f"The compared outputs passed a further filter. {spec.output_filter.sentence()}"
        )
    if spec.decimate > 1:
        sentences.append(f"One of every {spec.decimate} samples was kept after filtering.")
    if servo is not None:
        torque = "its torque is the missing joint torque"
        unknown = "no torque is known, so none is compared"
        sentences.append(
            f"A virtual servo of {servo.hz:g} Hz prescribes the measured joint motion; "
            f"{torque if model.drive.torque_known else unknown}."
        )
        seldom = sampling_warning(model, max(r.sample_time for r in recordings))
        if seldom and model.drive.torque_known:
            sentences.append(seldom)
    free = model.arm.coordinates - (0 if model.steering is None else model.arm.joints)
    if free and any(starts_unknown(spec, r) for r in recordings):
        sentences.append(IN_MOTION if spec.initial_state is None else ANY_START)
    for r in recordings:
        for channel, logged in r.logger_filters.items():
            sentences.append(
                f"{r.name}: the model's {channel} passed the logger's low-pass "
                f"({logged.frequency:g} rad/s, damping {logged.damping:g})."
            )
    return sentences
