"""Faults put into good recordings: what a check must name, with its channel and size."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from flexgui.core.check.measured_recording import MeasuredRecording

Rng = np.random.Generator


@dataclass(frozen=True)
class Seeded:
    """A spoilt recording and what is true of it."""

    recording: MeasuredRecording
    channels: frozenset[str]
    """Any of them may be named."""
    size: float | None
    """None where no number belongs to the fault."""


def _with(found: MeasuredRecording, **channels: np.ndarray) -> MeasuredRecording:
    return replace(found, channels={**found.channels, **channels})


def pick(found: MeasuredRecording, rng: Rng, *kinds: str) -> str:
    names = found.names(*kinds)
    return names[int(rng.integers(len(names)))] if names else ""


def times(
    kinds: tuple[str, ...], factors: tuple[float, ...]
) -> Callable[[MeasuredRecording, Rng], Seeded | None]:
    def make(found: MeasuredRecording, rng: Rng) -> Seeded | None:
        name = pick(found, rng, *kinds)
        factor = float(rng.choice(factors))
        if not name:
            return None
        spoilt = _with(found, **{name: factor * found.channels[name]})
        return Seeded(spoilt, frozenset({name}), factor)

    return make


def swapped(found: MeasuredRecording, rng: Rng) -> Seeded | None:
    pairs = [("theta1", "theta2"), ("dtheta1_ref", "dtheta2_ref"), ("z1", "z2")]
    pairs = [p for p in pairs if found.has(*p)]
    if not pairs:
        return None
    a, b = pairs[int(rng.integers(len(pairs)))]
    spoilt = _with(found, **{a: found.channels[b], b: found.channels[a]})
    return Seeded(spoilt, frozenset({a, b}), None)


def late(found: MeasuredRecording, rng: Rng) -> Seeded | None:
    name = pick(found, rng, "z#", "theta#", "i#", "u#", "deflection#")
    if not name:
        return None
    delay = float(rng.uniform(5.0, 15.0)) * found.step
    x = found.even(name)
    moved = np.interp(found.grid - delay, found.grid, x)
    moved = np.interp(found.time, found.grid, moved)
    return Seeded(_with(found, **{name: moved}), frozenset({name}), delay)


def drifting(found: MeasuredRecording, rng: Rng) -> Seeded | None:
    name = pick(found, rng, "z#", "i#")
    if not name:
        return None
    rate = float(rng.uniform(3e-3, 1e-2))
    x = found.even(name)
    start = found.grid[0]
    moved = np.interp(start + (found.grid - start) * (1 - rate), found.grid, x)
    moved = np.interp(found.time, found.grid, moved)
    return Seeded(_with(found, **{name: moved}), frozenset({name}), rate)


def dead(found: MeasuredRecording, rng: Rng) -> Seeded | None:
    name = pick(found, rng, "theta#", "z#", "i#", "u#", "deflection#")
    x = found.channels[name].copy()
    first, n = int(rng.uniform(0.2, 0.5) * len(x)), int(rng.uniform(0.15, 0.3) * len(x))
    x[first : first + n] = x[first]
    return Seeded(_with(found, **{name: x}), frozenset({name}), n * found.step)


def clipped(kinds: tuple[str, ...]) -> Callable[[MeasuredRecording, Rng], Seeded | None]:
    def make(found: MeasuredRecording, rng: Rng) -> Seeded | None:
        name = pick(found, rng, *kinds)
        if not name:
            return None
        x = found.channels[name]
        level = float(np.nanpercentile(x, rng.uniform(85.0, 95.0)))
        if level >= np.nanmax(x):
            return None  # two levels: nothing is cut off
        return Seeded(_with(found, **{name: np.minimum(x, level)}), frozenset({name}), level)

    return make


def quantised(found: MeasuredRecording, rng: Rng) -> Seeded | None:
    name = pick(found, rng, "theta#", "z#", "deflection#")
    x = found.channels[name]
    step = float(rng.uniform(0.1, 0.3) * np.nanstd(x))
    return Seeded(_with(found, **{name: step * np.round(x / step)}), frozenset({name}), step)


def dropped(found: MeasuredRecording, rng: Rng) -> Seeded | None:
    name = pick(found, rng, "theta#", "u#", "i#")
    x = found.channels[name].copy()
    lost = rng.choice(np.arange(1, len(x) - 1), int(0.02 * len(x)), replace=False)
    x[lost] = np.nan
    return Seeded(_with(found, **{name: x}), frozenset({name}), len(lost))


def rows_lost(found: MeasuredRecording, rng: Rng) -> Seeded | None:
    first, n = int(rng.uniform(0.2, 0.8) * found.rows), int(rng.integers(5, 40))
    keep = np.r_[0:first, first + n : found.rows]
    channels = {k: v[keep] for k, v in found.channels.items()}
    masks = {k: v[keep] for k, v in found.masks.items()}
    spoilt = replace(found, time=found.time[keep], channels=channels, masks=masks)
    return Seeded(spoilt, frozenset({"t"}), n)


def stuck_clock(found: MeasuredRecording, rng: Rng) -> Seeded | None:
    rows = rng.choice(np.arange(5, found.rows - 5, 3), int(rng.integers(3, 20)), replace=False)
    time = found.time.copy()
    time[rows] = time[rows - 1]
    return Seeded(replace(found, time=time), frozenset({"t"}), len(rows))


def jittered(found: MeasuredRecording, rng: Rng) -> Seeded | None:
    spread = float(rng.uniform(0.05, 0.15)) * found.step
    time = found.time + spread * np.clip(rng.standard_normal(found.rows), -3, 3)
    return Seeded(replace(found, time=time), frozenset({"t"}), spread)


def clock(factors: tuple[float, ...]) -> Callable[[MeasuredRecording, Rng], Seeded | None]:
    def make(found: MeasuredRecording, rng: Rng) -> Seeded | None:
        factor = float(rng.choice(factors))
        return Seeded(replace(found, time=factor * found.time), frozenset({"t"}), factor)

    return make


def wrong_rate(found: MeasuredRecording, rng: Rng) -> Seeded | None:
    """Only a rig whose references are speeds, or that has a law of motion, can tell."""
    return clock((0.5, 2.0, 0.1, 10.0))(found, rng) if found.names("dtheta#_ref") else None


def outlying(found: MeasuredRecording, rng: Rng) -> Seeded | None:
    name = pick(found, rng, "theta#", "z#", "deflection#", "i#")
    x = found.channels[name].copy()
    # More than a few per cent are no outliers.
    count = min(int(rng.integers(3, 9)), int(0.02 * len(x)))
    rows = rng.choice(np.arange(10, len(x) - 10, 7), count, replace=False)
    x[rows] += rng.choice([-1.0, 1.0], len(rows)) * rng.uniform(4.0, 8.0, len(rows)) * np.nanstd(x)
    return Seeded(_with(found, **{name: x}), frozenset({name}), len(rows))


def shifted(found: MeasuredRecording, rng: Rng) -> Seeded | None:
    if found.has("z1"):
        name, shift = pick(found, rng, "z#", "theta#"), float(rng.uniform(0.1, 0.3))
    else:
        name = pick(found, rng, "i#")
        if not name:
            return None
        shift = float(rng.uniform(0.5, 1.5) * np.std(found.channels[name]))
    spoilt = _with(found, **{name: found.channels[name] + shift})
    return Seeded(spoilt, frozenset({name}), shift)


def noisy(found: MeasuredRecording, rng: Rng) -> Seeded | None:
    """An encoder's noise a third of the motion."""
    name = pick(found, rng, "theta#")
    x = found.channels[name]
    noise = float(rng.uniform(0.2, 0.5)) * float(np.std(x))
    spoilt = _with(found, **{name: x + noise * rng.standard_normal(len(x))})
    return Seeded(spoilt, frozenset({name}), None)


def repeated(found: MeasuredRecording, rng: Rng) -> Seeded | None:
    names = found.names("dtheta#_ref", "theta#_ref")
    if not names:
        return None
    n = found.rows // 3
    channels = {k: np.tile(v[:n], 3) for k, v in found.channels.items()}
    time = found.time[0] + found.step * np.arange(3 * n)
    spoilt = replace(found, time=time, channels=channels, masks={})
    return Seeded(spoilt, frozenset(names), n * found.step)


def moving(found: MeasuredRecording, rng: Rng) -> Seeded | None:
    """Cut where a joint is at more than its rms speed."""
    name = pick(found, rng, "theta#")
    speed = np.gradient(found.even(name), found.step)
    inner = np.arange(int(0.1 * found.rows), int(0.6 * found.rows))
    usual = float(np.sqrt(np.mean(speed**2)))
    fast = inner[np.abs(speed[inner]) > 1.2 * usual]
    if not len(fast):
        return None
    first = int(rng.choice(fast))
    channels = {k: v[first:] for k, v in found.channels.items()}
    masks = {k: v[first:] for k, v in found.masks.items()}
    spoilt = replace(found, time=found.time[first:], channels=channels, masks=masks)
    return Seeded(spoilt, frozenset({name}), float(speed[first]))


ANGLES = ("theta#",)
FAULTS: dict[str, tuple[Callable[[MeasuredRecording, Rng], Seeded | None], ...]] = {
    "degrees": (times(ANGLES, (180 / np.pi,)),),
    "millimetres": (times(("z#",), (1000.0,)),),
    "sign": (times(("theta#", "z#", "i#", "u#", "dtheta#_ref"), (-1.0,)),),
    "swapped_joints": (swapped,),
    "gear_ratio": (times(ANGLES, (5.0, 20.0, 50.0, 100.0)),),
    "scale": (times(("theta#", "z#", "i#", "dtheta#_ref"), (0.5, 0.7, 1.4, 1.9)),),
    "delay": (late,),
    "dead": (dead,),
    "clipped": (clipped(("theta#", "z#", "deflection#")),),
    "quantised": (quantised,),
    "dropouts": (dropped, rows_lost),
    "repeated_times": (stuck_clock,),
    "jitter": (jittered,),
    "sample_time": (wrong_rate,),
    "clock_drift": (drifting,),
    "time_unit": (clock((1e3, 1e6)),),
    "outliers": (outlying,),
    "offset": (shifted,),
    "weak_excitation": (noisy,),
    "drive_saturated": (clipped(("u#", "i#")),),
    "repeated_cycles": (repeated,),
    "starts_moving": (moving,),
}
