"""Step and frequency response of the linear model at one posture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arm.joints import joint
from ..errors import InputError
from ..model import Model
from ..recording.channels import channel_kind, joint_of
from ..sensors import sensor
from ..simulate.posture import AT_REST, OSCILLATES, Posture, integrators

STEP_SAMPLES = 257
"""One more than a power of two: they are made by doubling."""

TAYLOR_DEGREE, TAYLOR_RADIUS = 16, 0.78
"""Up to that norm the polynomial is exact to rounding (Higham 2008, table 10.2)."""

POINTS_PER_DECADE = 48
AROUND_PEAK = np.array([-4.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 4.0])
"""Extra points about each resonance, in half widths of its peak."""

DECAYED = 6.0
"""Time constants of the slowest pole that a step response shows: exp(-6) is 0.25 %."""

MOST_PERIODS = 12.0
"""Periods of the slowest vibration that a step response shows where nothing damps it."""

NOTHING_MOVES = 1.0
"""s, the length of a step response without any pole but integrators."""

GAP_TO_RANGE = 10.0
"""Below the slowest and above the fastest corner the frequency axis runs on about this far."""


@dataclass(frozen=True)
class Port:
    """A reference or an output: its channel and unit."""

    name: str
    unit: str


@dataclass(frozen=True)
class LinearOutput:
    """y = C x + D r; shapes (ny, nx) and (ny, nr)."""

    ports: tuple[Port, ...]
    C: np.ndarray
    D: np.ndarray


@dataclass(frozen=True)
class StepResponse:
    """What each output does after a unit step of each reference."""

    time: np.ndarray
    """(N,) s"""
    values: np.ndarray
    """(N, ny, nr), output unit per unit of the reference, from the posture at rest."""
    outputs: tuple[Port, ...]
    references: tuple[Port, ...]


@dataclass(frozen=True)
class FrequencyResponse:
    """G(i w) from each reference to each output."""

    frequency: np.ndarray
    """(W,) Hz"""
    gain: np.ndarray
    """(W, ny, nr) complex; NaN at a frequency of a pole without damping, where it has no value"""
    outputs: tuple[Port, ...]
    references: tuple[Port, ...]


def default_output(model: Model) -> str:
    """ydot where it is defined, else the deflection of bending links, else the joints."""
    if model.arm.two_revolute:
        return "ydot"
    return "deflection" if any(model.arm.modes) else "encoder"


def linear_output(at: Posture, kind: str) -> LinearOutput:
    """An output of the linear model; of the tip camera and of accelerometers, the linearisation at
    the posture. InputError where a sensor has none."""
    source = sensor(kind)
    ports = tuple(Port(channel.name, channel.unit) for channel in source.channels(at.model.arm))
    slopes = source.linearised(at)
    if slopes is None:
        raise InputError(f"The {source.title} have no linear model.")
    return LinearOutput(ports, *slopes)


def references(at: Posture) -> tuple[Port, ...]:
    """What drives the arm, in the order of B's columns."""
    arm = at.model.arm
    names = at.model.drive.reference_channels(arm)[: at.numbers.law.references]
    return tuple(Port(name, _unit(name, at)) for name in names)


def _unit(name: str, at: Posture) -> str:
    """The first of a channel's units belongs to joints that turn, the second to slides."""
    units, which = channel_kind(name).units, joint_of(name)
    if which is None or len(units) == 1:
        return units[0]
    slides = joint(at.model.arm.segments[which].joint).coordinate_unit == "m"
    return units[1] if slides else units[0]


def step_response(
    at: Posture, kind: str | None = None, seconds: float | None = None
) -> StepResponse:
    """Exact at its samples; it takes `seconds`, or what suits the slowest pole."""
    output = linear_output(at, kind or default_output(at.model))
    inputs = references(at)
    length = horizon(at.poles) if seconds is None else seconds
    time = np.linspace(0.0, length, STEP_SAMPLES)
    x = _steps(at, time[1])[..., : len(inputs)]
    values = np.einsum("yx,txr->tyr", output.C, x) + output.D[:, : len(inputs)]
    return StepResponse(time, values, output.ports, inputs)


def _steps(at: Posture, dt: float) -> np.ndarray:
    """x (N, nx, nr) at multiples of dt after a unit step, by the exact discretisation."""
    nx, nr = at.B.shape
    rate = np.zeros((nx + nr, nx + nr))
    rate[:nx] = np.linalg.solve(at.E, np.hstack([at.A, at.B]))
    over = exponential(rate * dt)
    # x and r at the first 1, 2, 4, ... samples: each half follows from the one before.
    # Side by side in one matrix, for many small products cost more than a large one.
    powers = np.vstack([np.zeros((nx, nr)), np.eye(nr)])
    while powers.shape[1] < nr * STEP_SAMPLES:
        powers = np.hstack([powers, over @ powers])
        over = over @ over
    return powers[:nx, : nr * STEP_SAMPLES].reshape(nx, STEP_SAMPLES, nr).transpose(1, 0, 2)


def exponential(A: np.ndarray) -> np.ndarray:
    """exp(A) (n, n) by scaling and squaring of Taylor's polynomial.

    SciPy's costs 20 times as much here: its BLAS wakes threads for matrices of this size.
    """
    norm = float(np.abs(A).sum(axis=0).max(initial=0.0))
    squarings = max(int(np.ceil(np.log2(norm / TAYLOR_RADIUS))), 0) if norm > 0.0 else 0
    scaled = A / 2.0**squarings
    identity = np.eye(len(A))
    total = identity
    for k in range(TAYLOR_DEGREE, 0, -1):
        total = identity + scaled @ total / k
    for _ in range(squarings):
        total = total @ total
    return np.asarray(total)


def horizon(poles: np.ndarray) -> float:
    """s: a round time in which the slowest of the poles (nx,) in 1/s has decayed, or has swung
    often enough."""
    moving = poles[~integrators(poles)]
    decaying = moving[moving.real < -OSCILLATES * np.abs(moving)]
    swinging = moving[np.abs(moving.imag) > OSCILLATES * np.abs(moving)]
    times = [NOTHING_MOVES]
    if decaying.size:
        times = [DECAYED / float(np.abs(decaying.real).min())]
    if swinging.size:
        longest = MOST_PERIODS * 2.0 * np.pi / float(np.abs(swinging.imag).min())
        times = [min(*times, longest) if decaying.size else longest]
    return _round_up(times[0])


def _round_up(value: float) -> float:
    """To 1, 2 or 5 times a power of ten, so that an axis stays while a slider moves."""
    decade = 10.0 ** np.floor(np.log10(value))
    return float(next(k * decade for k in (1.0, 2.0, 5.0, 10.0) if k * decade >= value * 0.999))


def frequency_response(
    at: Posture, kind: str | None = None, frequency: np.ndarray | None = None
) -> FrequencyResponse:
    """G = C (i w E - A)^-1 B + D at every `frequency` (W,) in Hz at once; NaN at a pole."""
    output = linear_output(at, kind or default_output(at.model))
    inputs = references(at)
    f = frequency_grid(at.poles) if frequency is None else np.asarray(frequency, dtype=float)
    defined = ~_at_pole(f, at.poles)
    pencil = 2j * np.pi * f[defined, None, None] * at.E - at.A
    B = at.B[:, : len(inputs)].astype(complex)
    x = np.linalg.solve(pencil, np.broadcast_to(B, (len(pencil), *B.shape)))
    gain = np.full((len(f), len(output.ports), len(inputs)), complex(np.nan, np.nan))
    gain[defined] = output.C @ x + output.D[:, : len(inputs)]
    return FrequencyResponse(f, gain, output.ports, inputs)


def _at_pole(frequency: np.ndarray, poles: np.ndarray) -> np.ndarray:
    """(W,) bool: where i w, of the frequencies (W,) in Hz, is one of the poles (nx,) in 1/s but for
    rounding. An integrator that rounding has moved is taken at zero."""
    exact = np.where(integrators(poles), 0.0, poles)
    rounding = AT_REST * np.abs(poles).max(initial=0.0) + OSCILLATES
    away = np.abs(2j * np.pi * frequency[:, None] - exact)
    return np.asarray((away <= rounding).any(axis=1))


def frequency_grid(poles: np.ndarray) -> np.ndarray:
    """(W,) Hz for poles (nx,) in 1/s: even on a logarithmic axis over whole decades, and finer at
    each resonance. One without damping has no width: its points fill the even ones' distance."""
    moving = poles[~integrators(poles)]
    swinging = moving[moving.imag > OSCILLATES * np.abs(moving)]
    corners = np.abs(swinging if swinging.size else moving) / (2.0 * np.pi)
    if not corners.size:
        corners = np.ones(1)
    first = np.floor(np.log10(corners.min() / GAP_TO_RANGE))
    last = np.ceil(np.log10(corners.max() * 1.5))
    even = np.logspace(first, last, int((last - first) * POINTS_PER_DECADE) + 1)
    centres, widths = swinging.imag / (2.0 * np.pi), np.abs(swinging.real) / (2.0 * np.pi)
    spacing = (10.0 ** (1.0 / POINTS_PER_DECADE) - 1.0) / AROUND_PEAK.max()
    undamped = widths <= OSCILLATES * centres
    widths = np.where(undamped, spacing * centres, widths)
    around = (centres[:, None] + widths[:, None] * AROUND_PEAK).ravel()
    inside = around[(around > even[0]) & (around < even[-1])]
    return np.unique(np.concatenate([even, inside]))
