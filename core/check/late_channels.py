"""Which channel is late or on another clock, with free stiffness and friction.

For each channel a constant lag, or one that grows from zero (two clocks), is fitted together with
the links' stiffness and damping. The result is the cause that explains most. Nothing that is
usually stated wrong takes part: stiffness is fitted, gains and friction are coefficients of a
regression.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from ..check.gain_and_lag import ALIKE
from ..check.link_bending import LIGHT, LinkBending, LinkShape
from ..check.measured_recording import MeasuredRecording, lattice_step
from ..least_squares import (
    GOOD_ENOUGH,
    SAME_START,
    BoundsAndPrior,
    Descended,
    levenberg_marquardt,
    normal_equations,
    pseudo_inverse,
)
from ..recording.channels import DRIVES, Role, is_reference, role_of

STIFFNESS_STARTS = tuple(np.geomspace(0.2, 5.0, 13))
"""Factors on the stated stiffness for the starts of a fit: estimates from a drawing are a factor of
4 off, and a fit must start within some ten per cent of a resonance."""
LAGS = (1.0, 2.0, 4.0, 7.0, 10.0, 13.0, 16.0)
"""Samples of lag for the starts of a fit, which finds what is within half a period."""
GROWING_LAGS = (-20.0, -8.0, -3.0, -1.0, 1.0, 3.0, 8.0, 20.0)
"""The same for a growing lag, at the end of a recording."""
MOST_LAG = 1.5 * GROWING_LAGS[-1]
"""Largest samples of lag: a fit far beyond its starts has lost the period and is invalid."""
CLOSEST = 3
"""Best scanned causes that are fitted."""
FINE = 1e-3
"""Share of a channel's spread: smallest model error."""
STIFFEST, LIGHTEST = np.log(30.0), (np.log(1e-5), np.log(0.3))
"""Bounds of the logarithms: beyond 30 times a link is rigid."""


@dataclass(frozen=True)
class LateCause:
    """Channels that may be late together; `grows`: the lag grows from zero."""

    channels: tuple[str, ...] = ()
    grows: bool = False


PUNCTUAL = LateCause()


@dataclass(frozen=True)
class LateResult:
    """The cause that explains most."""

    cause: LateCause
    size: float
    """s; where it grows s/s"""
    error: float
    """Its standard deviation."""
    left: float
    """Remaining share of the unexplained variance, in the channel that gains most."""


def shape_of(recording: MeasuredRecording) -> LinkShape | None:
    """The links fitted with all channels punctual, once per recording; None if it does not show
    them."""
    if LinkShape not in recording.cache:
        fit = LinkFit.of(recording)
        recording.cache[LinkShape] = None if fit is None else fit.shape(fit.fit_punctual())
    shape = recording.cache[LinkShape]
    return shape if isinstance(shape, LinkShape) else None


def late_channel(
    recording: MeasuredRecording, others: Sequence[LinkShape] = ()
) -> LateResult | None:
    """The cause that explains most, whatever the stiffness; None if no lag does.

    Args:
        others: The same links as other recordings show them, where a fit may begin as well.
    """
    fit, punctual = LinkFit.of(recording), shape_of(recording)
    if fit is None or punctual is None:
        return None
    plain = fit.unknowns([punctual])
    begins, middle = [plain], fit.unknowns([*others] or [punctual])
    if np.any(np.abs(middle - plain)[: fit.segments] > SAME_START):
        plain = min(plain, fit.fit(PUNCTUAL, middle).vector, key=fit.cost)
        begins = [plain, middle]
    least, best = fit.cost(plain), None
    scanned = sorted((fit.scan(cause, begins) for cause in fit.causes()), key=lambda s: s[0])
    for cost, cause, start in scanned[:CLOSEST]:
        if cost < fit.cost(plain):
            fit_of_cause = fit.fit(cause, start)
            cost = fit.cost(fit_of_cause.vector, cause)
            if cost < least and abs(fit_of_cause.vector[-1]) < MOST_LAG:
                least, best = cost, (cause, fit_of_cause)
    if best is None:
        return None
    cause, end = best
    before, after = fit.residuals(PUNCTUAL, plain), fit.residuals(cause, end.vector)
    share_left = min(float(np.var(after[n]) / max(np.var(before[n]), 1e-300)) for n in after)
    return LateResult(cause, fit.size(cause, end.vector), fit.deviation(cause, end), share_left)


@dataclass(frozen=True)
class LinkFit:
    """Fit of stiffness and damping of one recording's links, and of a channel's lag.

    Unknowns: logarithms of stiffnesses and damping; with a cause its lag in samples (at the end, if
    it grows).
    """

    links: LinkBending

    @classmethod
    def of(cls, recording: MeasuredRecording) -> LinkFit | None:
        """None where no link bends, or the recording shows none of them."""
        links = LinkBending.of(recording)
        fit = None if links is None or not links.segments.size else cls(links)
        return fit if fit is not None and fit.names else None

    @cached_property
    def segments(self) -> int:
        """How many of the links bend."""
        return int(self.links.segments.max()) + 1

    @cached_property
    def names(self) -> list[str]:
        """The channels that are explained."""
        shape = LinkShape(np.ones(self.segments), LIGHT)
        sensed = list(self.links.sensed(self.links.coordinates(shape, self.links.q)))
        return sensed + [name for name in self.driven if self.links.found.has(name)]

    @cached_property
    def driven(self) -> tuple[str, ...]:
        """The drive signals of the joints: speed references, torques or currents; others are no sum
        of inertia and friction."""
        model = self.links.model
        names = model.drive.reference_channels(model.arm)
        explained = all(role_of(n) in (*DRIVES, Role.SPEED) for n in names)
        return names if explained and len(names) == model.arm.joints else ()

    @cached_property
    def places(self) -> list[str]:
        """The encoders."""
        return [f"theta{k + 1}" for k in range(self.links.model.arm.joints)]

    @cached_property
    def floors(self) -> dict[str, float]:
        """Channel -> variance below which an error says nothing: rounding, noise, model."""
        values = {n: self.links.channel(n) for n in self.names}
        return {
            n: lattice_step(y) ** 2 / 12.0 + (FINE * float(np.std(y))) ** 2
            for n, y in values.items()
        }

    @cached_property
    def _friction(self) -> tuple[np.ndarray, np.ndarray]:
        """Speeds and directions by the punctual encoders."""
        return self.links.friction_inputs(self.links.q)

    @cached_property
    def _drive_signals(self) -> dict[str, np.ndarray]:
        return {
            n: self.links.as_applied(self.links.channel(n)) for n in self.driven if n in self.names
        }

    def causes(self) -> list[LateCause]:
        """Channels that may be late, in both ways; written references cannot."""
        groups: list[tuple[str, ...]] = [
            (n,) for n in (*self.places, *self.names) if not is_reference(n)
        ]
        groups += [("z1", "z2")] if {"z1", "z2"} <= set(self.names) else []
        return [LateCause(group, grows) for group in groups for grows in (False, True)]

    def unknowns(self, shapes: Sequence[LinkShape]) -> np.ndarray:
        """Unknowns of the links' median shape."""
        logs = [np.log([*s.stiffness, s.damping]) for s in shapes]
        return np.asarray(np.median(logs, axis=0))

    def shape(self, x: np.ndarray) -> LinkShape:
        """The links of an unknown vector."""
        return LinkShape(np.exp(x[: self.segments]), float(np.exp(x[self.segments])))

    def size(self, cause: LateCause, x: np.ndarray) -> float:
        """s; where it grows s/s"""
        if not cause.channels:
            return 0.0
        return float(x[-1]) * (1.0 / len(self.links.q) if cause.grows else self.links.found.step)

    def fit_punctual(self) -> np.ndarray:
        """The unknowns without a cause: the best common stiffness factor, then the best of each
        segment, then a fit."""
        x = np.array([*np.zeros(self.segments), np.log(LIGHT)])
        rows = np.eye(self.segments + 1)[:-1]
        for which in (rows.sum(axis=0), *(rows if self.segments > 1 else ())):
            tried = (x + np.log(factor) * which for factor in STIFFNESS_STARTS)
            x = min((np.clip(start, *self._bounds(start)) for start in tried), key=self.cost)
        return self.fit(PUNCTUAL, x).vector

    def scan(
        self, cause: LateCause, begins: Sequence[np.ndarray]
    ) -> tuple[float, LateCause, np.ndarray]:
        """(cost, cause, unknowns) at the best starting lag."""
        tried = [
            np.array([*x, lag]) for x in begins for lag in (GROWING_LAGS if cause.grows else LAGS)
        ]
        costs = [self.cost(x, cause) for x in tried]
        return min(costs), cause, tried[int(np.argmin(costs))]

    def cost(self, x: np.ndarray, cause: LateCause = PUNCTUAL) -> float:
        """Twice the negative log-likelihood at the noise that each channel shows, per sample."""
        return float(sum(np.log(each) for each in self._noise(self.residuals(cause, x)).values()))

    def _noise(self, rests: Mapping[str, np.ndarray]) -> dict[str, float]:
        """Variance of each channel's errors."""
        return {n: float(np.mean(r**2)) + self.floors[n] for n, r in rests.items()}

    def residuals(self, cause: LateCause, x: np.ndarray) -> dict[str, np.ndarray]:
        """Residual (m,) of each channel with the cause as large as x states."""
        shape, size = tuple(x[: self.segments + 1]), self.size(cause, x)
        when = self._shown_times(cause, size)
        if any(n in cause.channels for n in self.places):
            return {n: self._residual(n, r) for n, r in self._rows(shape, when, cause).items()}
        rows, punctual = self._punctual(shape)
        return {
            n: self._residual(n, rows[n], when) if n in cause.channels else rest
            for n, rest in punctual.items()
        }

    def _residual(self, n: str, rows: np.ndarray, when: np.ndarray | None = None) -> np.ndarray:
        """Residual (m,) of a channel after a regression on rows (k, M); `when` (M,) s: the times
        at which its samples appear, if it is late."""
        t, inner = self.links.grid, self.links.inner
        if n in self.driven:
            y = self._drive_signals[n]
            if when is not None:
                y = self.links.as_applied(np.interp(when, t, self.links.channel(n)))
            return _regression_residual(y[inner], rows[:, inner])
        # The answer is moved and not a sensor's measurement, whose noise would shrink between the
        # samples and draw the lag there.
        if when is not None:
            at = (2.0 * t - when)[inner]
            rows = np.array([np.interp(at, t, each) for each in rows])
        else:
            rows = rows[:, inner]
        return _regression_residual(self.links.channel(n)[inner], rows)

    @cached_property
    def _punctual(self):  # type: ignore[no-untyped-def]
        """Rows and residuals of all channels without a late one, for the last shapes: a sensor's
        lag changes only its own."""

        @lru_cache(maxsize=8)
        def punctual(shape: tuple[float, ...]):  # type: ignore[no-untyped-def]
            rows = self._rows(shape, self.links.grid, PUNCTUAL)
            return rows, {n: self._residual(n, each) for n, each in rows.items()}

        return punctual

    def _shown_times(self, cause: LateCause, size: float) -> np.ndarray:
        """(M,) s: times at which samples of a late channel appear."""
        t = self.links.grid
        return np.asarray(t + size * (t - t[0] if cause.grows else 1.0))

    def _rows(
        self, unknowns: tuple[float, ...], when: np.ndarray, cause: LateCause
    ) -> dict[str, np.ndarray]:
        """Rows (k, M) of the regression of each channel; the cause's encoders show what was at the
        times `when` (M,) s."""
        shape, links = self.shape(np.array(unknowns)), self.links
        t = links.grid
        q = np.column_stack(
            [
                np.interp(when, t, place) if n in cause.channels else place
                for n, place in zip(self.places, links.q.T, strict=True)
            ]
        )
        whole, ringing = links.coordinates(shape, q), links.free_vibrations(shape)
        rows = {n: np.array([y, *ringing]) for n, y in links.sensed(whole).items()}
        if self._drive_signals:
            moved = any(n in cause.channels for n in self.places)
            speed, dry = links.friction_inputs(q) if moved else self._friction
            torques = links.torques(whole)
            # Not smoothed: a filter of both directions hardly does more than scale a vibration.
            rows |= {
                n: np.array([torques[:, k], speed[:, k], dry[:, k], *ringing])
                for k, n in enumerate(self.driven)
                if n in self._drive_signals
            }
        return rows

    def fit(self, cause: LateCause, x: np.ndarray) -> Descended:
        """Least squares in units of the errors' standard deviations, which are updated with each
        step until the cost stays: a logarithm's tangent lies above it, so each step lowers it."""
        limits, steps = BoundsAndPrior(*self._bounds(x), self._strides(x)), 0.02 * self._strides(x)
        sizes = np.ones(0)

        def errors(x: np.ndarray) -> list[np.ndarray]:
            rests = self.residuals(cause, x).values()
            return [r / size for r, size in zip(rests, sizes, strict=True)]

        def slopes(x: np.ndarray) -> list[np.ndarray]:
            moved = zip(*map(errors, x + np.diag(steps)), strict=True)
            rests = zip(errors(x), moved, strict=True)
            return [(np.column_stack(m) - r[:, None]) / steps for r, m in rests]

        before, cost = np.inf, self.cost(x, cause)
        while before - cost > GOOD_ENOUGH:
            sizes = np.sqrt(list(self._noise(self.residuals(cause, x)).values()))
            end = levenberg_marquardt(errors, slopes, x, limits, most=1)
            x, before, cost = end.vector, cost, self.cost(end.vector, cause)
        return end

    def _strides(self, x: np.ndarray) -> np.ndarray:
        """Typical size of each unknown: half the stiffness, threefold damping, six samples."""
        return np.array([0.5] * self.segments + [1.0] + [6.0] * (len(x) - self.segments - 1))

    def _bounds(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        s, free = self.segments, len(x) - self.segments - 1
        lower = [-STIFFEST] * s + [LIGHTEST[0]] + [-MOST_LAG] * free
        return np.array(lower), np.array([STIFFEST] * s + [LIGHTEST[1]] + [MOST_LAG] * free)

    def deviation(self, cause: LateCause, end: Descended) -> float:
        """Standard deviation of the cause's size."""
        normal, _ = normal_equations(end.blocks, end.slopes)
        x = np.zeros_like(end.vector)
        x[-1] = np.sqrt(ALIKE * abs(np.linalg.pinv(normal)[-1, -1]))
        return self.size(cause, x)


def _regression_residual(y: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Residual of y (M,) after a regression on rows (k, M) and a constant."""
    y, A = y - y.mean(), rows - rows.mean(axis=1, keepdims=True)
    # Few columns that are scaled: squaring their condition costs digits below any noise.
    return np.asarray(y - (pseudo_inverse(A @ A.T) @ (A @ y)) @ A)
