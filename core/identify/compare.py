"""Measured against model, output by output, and the joint torque that the model lacks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..arm.chord import deflection_rows
from ..arm.joints import joint
from ..errors import InputError
from ..identify.defect_correction import with_enough_steps
from ..identify.predictor import Predictor
from ..identify.prepared_recording import Prepared, can_measure, prepare
from ..identify.processing import TORQUE, Processing
from ..identify.residuals import Residuals, channel_weights
from ..identify.unknowns import Unknowns
from ..loading import joint_units
from ..model import Model
from ..recording.channels import Role, channel_kind, role_of
from ..recording.recording import Recording
from ..results import (
    ChannelComparison,
    InputSignal,
    JointMotion,
    MissingTorque,
    RecordingComparison,
)
from ..sensors import sensors
from ..sensors.sensor import Sensor
from ..trajectory import Trajectory


def visible_outputs(model: Model, recording: Recording, fitted: Sequence[Sensor]) -> list[Sensor]:
    """The fitted outputs that the recording holds, then every other one."""
    shown = [s for s in fitted if can_measure(model, recording, s)]
    servo = model.steering is not None
    torque = servo and model.drive.torque_known
    for kind, sensor in sensors().items():
        available = torque if kind == "torque" else sensor.available(recording, model.arm)
        if sensor in shown or not available or (kind == "encoder" and servo):
            continue
        try:
            sensor.check(model.arm, recording)
        except InputError:
            continue  # an output that is not defined here is simply not shown
        shown.append(sensor)
    return shown


def predictor_of(
    experiments: Sequence[Prepared], values: Mapping[str, float] | None = None,
    own: Mapping[str, Mapping[str, float]] | None = None, steps: int | None = None,
) -> Predictor:  # fmt: skip
    """What predicts recordings at some values, `own` for each by name, with so many `steps` per
    sample; None: that twice as many hardly change what is left of them."""
    predictor = Predictor(experiments, Unknowns(()), values or {}, steps=steps or 1, own=own or {})
    if steps is not None or not predictor.simulation_is_expensive:
        return predictor
    residuals = Residuals(predictor, channel_weights(experiments, {}))
    return with_enough_steps(residuals, np.zeros(0)).predictor


def compare(
    model: Model, recording: Recording, fitted: Sequence[Sensor], processing: Processing,
    values: Mapping[str, float], fit_label: str, steps: int | None = None,
) -> RecordingComparison:  # fmt: skip
    """`compare_many` of one."""
    chosen = [(recording, values, fit_label)]
    return compare_many(model, chosen, fitted, processing, steps)[0]


def compare_many(
    model: Model, chosen: Sequence[tuple[Recording, Mapping[str, float], str]],
    fitted: Sequence[Sensor], processing: Processing, steps: int | None = None,
) -> list[RecordingComparison]:  # fmt: skip
    """Recordings at the parameter values given with each, simulated side by side. `chosen`:
    (recording, values, label of their fit); `fitted`: the outputs that were fitted; `steps` per
    sample, None: as many as what is left needs."""
    experiments = [
        prepare(model, r, visible_outputs(model, r, fitted), processing) for r, _, _ in chosen
    ]
    own = {r.name: values for r, values, _ in chosen}
    predictor = predictor_of(experiments, {}, own, steps)
    motions = predictor.trajectories([(np.zeros(0), range(len(experiments)))])[0]
    simulated = f"Simulated with {predictor.steps} steps per sample."
    note, comparisons = simulated if predictor.simulation_is_expensive else "", []
    for e, motion, (_, _, label) in zip(experiments, motions, chosen, strict=True):
        predicted = e.processed(e.readings(*motion))
        count = sum(len(s.channels(model.arm)) for s in e.outputs if s in fitted)
        channels = tuple(
            ChannelComparison(
                channel=name,
                unit=unit,
                time=e.time,
                measured=e.measured[:, k],
                model=predicted[:, k],
                counted=e.counted[:, k],
                fitted=k < count,
            )  # fmt: skip
            for k, (name, unit) in enumerate(e.channels)
        )
        comparisons.append(
            RecordingComparison(
                recording=e.recording.name,
                role=e.recording.role,
                fit_label=label,
                channels=channels,
                missing_torque=_missing(e, channels),
                note=note,
                tip_rms=_tip_rms(channels),
                theta2=e.recording.theta2,
                motion=_motion(e, motion[0]),
                inputs=_inputs(e),
            )  # fmt: skip
        )
    return comparisons


def _inputs(experiment: Prepared) -> tuple[InputSignal, ...]:
    """References of the drive; the measured speeds where a virtual servo prescribes the motion."""
    model, recording = experiment.model, experiment.recording
    arm, keep = model.arm, slice(None, None, experiment.processing.decimate)
    if model.steering is not None:
        units = [f"{joint(s.joint).coordinate_unit}/s" for s in arm.segments]
        names = [f"dtheta{k + 1}" for k in range(arm.joints)]
        signals = model.steering.motion(recording, arm).speed
    else:
        names = list(model.drive.reference_channels(arm))
        known = joint_units(arm)
        units = [known.get(name) or channel_kind(name).units[0] for name in names]
        signals = model.drive.signals(recording, arm)
    columns = signals[keep, : len(names)].T
    return tuple(InputSignal(*each) for each in zip(names, units, columns, strict=True))


def _motion(experiment: Prepared, trajectory: Trajectory) -> JointMotion:
    """Joint motion at the outputs' times; accelerations are differences of the simulated rates."""
    arm, keep = trajectory.arm, slice(None, None, experiment.processing.decimate)
    rates = trajectory.v[:, : arm.joints]
    acceleration = np.gradient(rates, experiment.recording.sample_time, axis=0)
    bent = trajectory.q @ deflection_rows(arm, trajectory.p).T
    return JointMotion(
        position=trajectory.joint_positions[keep],
        velocity=rates[keep],
        acceleration=acceleration[keep],
        deflection=bent[keep],
        units=tuple(joint(s.joint).coordinate_unit for s in arm.segments),
    )


def _tip_rms(channels: Sequence[ChannelComparison]) -> float | None:
    """Root mean square distance of the tip in m; None without a camera."""
    by_name = {c.channel: c for c in channels}
    if not {"z1", "z2"} <= by_name.keys():
        return None
    a, b = by_name["z1"], by_name["z2"]
    both = a.counted & b.counted
    if not both.any():
        return None
    return float(np.sqrt(np.mean(a.residual[both] ** 2 + b.residual[both] ** 2)))


def _missing(
    experiment: Prepared, channels: Sequence[ChannelComparison]
) -> tuple[MissingTorque, ...]:
    """Recorded minus modelled torque along the measured motion, with a virtual servo."""
    model = experiment.model
    if model.steering is None:
        return ()
    speed = model.steering.motion(experiment.recording, model.arm).speed
    dt, kinds = experiment.recording.sample_time, (TORQUE,) * model.arm.joints
    speed = experiment.processing.apply(speed, dt, kinds)
    torques = [c for c in channels if role_of(c.channel) is Role.TORQUE]
    records = []
    for k, c in enumerate(torques):
        if k + 1 in model.drive.torque_unknown:
            continue
        kind = joint(model.arm.segments[k].joint)
        records.append(
            MissingTorque(
                joint=k + 1,
                unit=kind.effort_unit,
                time=c.time,
                velocity=speed[:, k],
                velocity_unit=f"{kind.coordinate_unit}/s",
                missing=c.residual,
                applied=c.measured,
                counted=c.counted,
            )
        )
    return tuple(records)
