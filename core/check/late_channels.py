"""Which channel is late, or on another clock, with the stiffness and the friction left free.

Each channel in turn is taken for late, by a lag or by one that grows from nothing (two clocks that
start together), and the links' stiffness and damping are fitted beside it. The cause is the one
that explains most. Nothing that a newcomer's scenario has wrong takes part: stiffness is fitted,
gains and friction are coefficients of a regression.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from ..check.gain_and_lag import ALIKE
from ..check.link_bending import LIGHT, LinkBending, LinkShape
from ..check.measured_recording import MeasuredRecording, lattice_step
from ..least_squares import GOOD_ENOUGH, Descended, Limits, descend, normal_equations
from ..recording.channels import DRIVES, Role, is_reference, role_of

STIFFNESS_STARTS = tuple(np.geomspace(0.2, 5.0, 13))
"""Times the stated stiffness at which a fit may begin: estimates from a drawing are a factor of 4
off, and a resonance shows to a fit that begins within some ten per cent of its frequency."""
LAGS = (1.0, 2.0, 4.0, 7.0, 10.0, 13.0, 16.0)
"""Samples of lag at which a fit may begin: it finds what is within half a period of it."""
GROWING_LAGS = (-20.0, -8.0, -3.0, -1.0, 1.0, 3.0, 8.0, 20.0)
"""The same at the end of a recording, where the lag grows."""
MOST_LAG = 1.5 * GROWING_LAGS[-1]
"""Samples of lag at most: a fit that leaves the lags at which it may begin by more than half has
lost the period that it began in, and says nothing."""
CLOSEST = 3
"""Causes, of all that were scanned, that are fitted."""
FINE = 1e-3
"""Of a channel's spread, below which no model is right."""
STIFFEST, LIGHTEST = np.log(30.0), (np.log(1e-5), np.log(0.3))
"""Bounds of the logarithms: beyond 30 times no link shows whether it is stiff or rigid."""


@dataclass(frozen=True)
class LateCause:
    """Channels that may be late together; `grows`: by a lag that grows from nothing."""

    channels: tuple[str, ...] = ()
    grows: bool = False


PUNCTUAL = LateCause()


@dataclass(frozen=True)
class LateResult:
    """What explains most."""

    cause: LateCause
    size: float
    """s; where it grows s/s"""
    error: float
    """Its standard deviation."""
    left: float
    """Share of what remained unexplained that still does, in the channel that gains most."""


def shape_of(found: MeasuredRecording) -> LinkShape | None:
    """The links as a recording shows them where all channels are taken for punctual, fitted once;
    None where it shows none of them."""
    if LinkShape not in found.derived:
        fit = LinkFit.of(found)
        found.derived[LinkShape] = None if fit is None else fit.shape(fit.alone())
    shape = found.derived[LinkShape]
    return shape if isinstance(shape, LinkShape) else None


def late_channel(found: MeasuredRecording, others: Sequence[LinkShape] = ()) -> LateResult | None:
    """The cause that explains most, whatever the stiffness; None where no lag explains anything.

    Args:
        others: The same links as other recordings show them, where a fit may begin as well.
    """
    fit, alone = LinkFit.of(found), shape_of(found)
    if fit is None or alone is None:
        return None
    plain = fit.unknowns([alone])
    begins = [plain]
    if others:
        middle = fit.unknowns(others)
        plain = min(plain, fit.fitted(PUNCTUAL, middle).vector, key=fit.cost)
        begins = [plain, middle]
    least, best = fit.cost(plain), None
    scanned = sorted((fit.scanned(cause, begins) for cause in fit.causes()), key=lambda s: s[0])
    for cost, cause, start in scanned[:CLOSEST]:
        if cost < fit.cost(plain):
            found_ = fit.fitted(cause, start)
            cost = fit.cost(found_.vector, cause)
            if cost < least and abs(found_.vector[-1]) < MOST_LAG:
                least, best = cost, (cause, found_)
    if best is None:
        return None
    cause, end = best
    before, after = fit.rests(PUNCTUAL, plain), fit.rests(cause, end.vector)
    left = min(float(np.var(after[n]) / max(np.var(before[n]), 1e-300)) for n in after)
    return LateResult(cause, fit.size(cause, end.vector), fit.deviation(cause, end), left)


@dataclass(frozen=True)
class LinkFit:
    """Stiffness and damping of the links of one recording, and how late a channel is.

    Unknowns: logarithms of stiffnesses and damping; with a cause its lag in samples (at the
    end, where it grows)."""

    links: LinkBending

    @classmethod
    def of(cls, found: MeasuredRecording) -> LinkFit | None:
        """None where the recording shows none of the links."""
        links = LinkBending.of(found)
        made = None if links is None else cls(links)
        return made if made is not None and made.names else None

    @cached_property
    def segments(self) -> int:
        """How many of the links bend."""
        return int(self.links.segments.max()) + 1

    @cached_property
    def names(self) -> list[str]:
        """The channels that are explained."""
        shape = LinkShape(np.ones(self.segments), LIGHT)
        found = list(self.links.sensed(self.links.moved(shape, self.links.q)))
        return found + [name for name in self.driven if self.links.found.has(name)]

    @cached_property
    def driven(self) -> tuple[str, ...]:
        """What drives each joint: speed references, torques or currents; nothing else is known to
        be a sum of inertia and friction."""
        model = self.links.model
        names = model.drive.reference_channels(model.arm)
        known = all(role_of(n) in (*DRIVES, Role.SPEED) for n in names)
        return names if known and len(names) == model.arm.joints else ()

    @cached_property
    def places(self) -> list[str]:
        """The encoders."""
        return [f"theta{k + 1}" for k in range(self.links.model.arm.joints)]

    @cached_property
    def floors(self) -> dict[str, float]:
        """Channel -> variance below which an error says nothing: rounding, noise, the model's
        own."""
        known = {n: self.links.channel(n) for n in self.names}
        return {
            n: lattice_step(y) ** 2 / 12.0 + (FINE * float(np.std(y))) ** 2
            for n, y in known.items()
        }

    @cached_property
    def _held(self) -> dict[str, np.ndarray]:
        return {n: self.links.held(self.links.channel(n)) for n in self.driven if n in self.names}

    def causes(self) -> list[LateCause]:
        """Channels that may be late, in both ways; a reference that was written is not."""
        groups: list[tuple[str, ...]] = [
            (n,) for n in (*self.places, *self.names) if not is_reference(n)
        ]
        groups += [("z1", "z2")] if {"z1", "z2"} <= set(self.names) else []
        return [LateCause(group, grows) for group in groups for grows in (False, True)]

    def unknowns(self, shapes: Sequence[LinkShape]) -> np.ndarray:
        """Those of the links' middle shape."""
        logs = [np.log([*one.stiffness, one.damping]) for one in shapes]
        return np.asarray(np.median(logs, axis=0))

    def shape(self, x: np.ndarray) -> LinkShape:
        """Of the links."""
        return LinkShape(np.exp(x[: self.segments]), float(np.exp(x[self.segments])))

    def size(self, cause: LateCause, x: np.ndarray) -> float:
        """s; where it grows s/s"""
        if not cause.channels:
            return 0.0
        return float(x[-1]) * (1.0 / len(self.links.q) if cause.grows else self.links.found.step)

    def alone(self) -> np.ndarray:
        """The unknowns without a cause, from the best common factor of the stiffness on, then the
        best one of each segment."""
        x = np.array([*np.zeros(self.segments), np.log(LIGHT)])
        rows = np.eye(self.segments + 1)[:-1]
        for which in (rows.sum(axis=0), *(rows if self.segments > 1 else ())):
            tried = (x + np.log(factor) * which for factor in STIFFNESS_STARTS)
            x = min((np.clip(one, *self._bounds(one)) for one in tried), key=self.cost)
        return self.fitted(PUNCTUAL, x).vector

    def scanned(
        self, cause: LateCause, begins: Sequence[np.ndarray]
    ) -> tuple[float, LateCause, np.ndarray]:
        """(cost, cause, unknowns) at the best of the lags at which a fit may begin."""
        tried = [
            np.array([*x, lag]) for x in begins for lag in (GROWING_LAGS if cause.grows else LAGS)
        ]
        costs = [self.cost(x, cause) for x in tried]
        return min(costs), cause, tried[int(np.argmin(costs))]

    def cost(self, x: np.ndarray, cause: LateCause = PUNCTUAL) -> float:
        """Twice the negative log-likelihood at the noise that each channel shows, per sample."""
        return float(sum(np.log(each) for each in self._noise(self.rests(cause, x)).values()))

    def _noise(self, rests: Mapping[str, np.ndarray]) -> dict[str, float]:
        """Variance of each channel's errors."""
        return {n: float(np.mean(r**2)) + self.floors[n] for n, r in rests.items()}

    def rests(self, cause: LateCause, x: np.ndarray) -> dict[str, np.ndarray]:
        """What remains of each channel (m,) while the cause is as large as x says."""
        t, size, inner = self.links.grid, self.size(cause, x), self.links.inner
        when = self._when(cause, size)
        at, made = (2.0 * t - when)[inner], {}
        encoder = any(n in cause.channels for n in self.places)
        moved = (cause, size) if encoder else (PUNCTUAL, 0.0)
        for n, rows in self._answered(tuple(x[: self.segments + 1]), *moved).items():
            y, own, driven = self.links.channel(n), n in cause.channels, n in self.driven
            if driven:
                y = self.links.held(np.interp(when, t, y)) if own else self._held[n]
            # The answer is moved and not a sensor's measurement, whose noise would shrink between
            # the samples and draw the lag there.
            late = own and not driven
            rows = np.array([np.interp(at, t, each) for each in rows]) if late else rows[:, inner]
            made[n] = _regression_residual(y[inner], rows)
        return made

    def _when(self, cause: LateCause, size: float) -> np.ndarray:
        """(M,) s, the times at which the samples of a late channel show."""
        t = self.links.grid
        return np.asarray(t + size * (t - t[0] if cause.grows else 1.0))

    @cached_property
    def _answered(self):  # type: ignore[no-untyped-def]
        """The last answers are kept, as a lag of a sensor alone changes none of them."""
        return lru_cache(maxsize=8)(self._answers)

    def _answers(
        self, unknowns: tuple[float, ...], cause: LateCause, size: float
    ) -> dict[str, np.ndarray]:
        """What explains each channel, as rows (k, M) of a regression; the cause is an encoder's."""
        shape, links = self.shape(np.array(unknowns)), self.links
        t, when = links.grid, self._when(cause, size)
        q = np.column_stack(
            [
                np.interp(when, t, place) if n in cause.channels else place
                for n, place in zip(self.places, links.q.T, strict=True)
            ]
        )
        whole, ringing = links.moved(shape, q), links.ringing(shape)
        made = {n: np.array([y, *ringing]) for n, y in links.sensed(whole).items()}
        if self._held:
            torques, (speed, dry) = links.torques(whole), links.rubbed(q)
            smooth = list(links.smooth(np.array(ringing).T).T) if ringing else []
            made |= {
                n: np.array([torques[:, k], speed[:, k], dry[:, k], *smooth])
                for k, n in enumerate(self.driven)
                if n in self._held
            }
        return made

    def fitted(self, cause: LateCause, x: np.ndarray) -> Descended:
        """Least squares in the errors' own standard deviations, which are taken anew until the cost
        stays: the tangent of a logarithm lies above it, so each descent lowers the cost."""
        limits, steps = Limits(*self._bounds(x), self._strides(x)), 0.02 * self._strides(x)
        sizes = np.ones(0)

        def errors(x: np.ndarray) -> list[np.ndarray]:
            rests = self.rests(cause, x).values()
            return [r / size for r, size in zip(rests, sizes, strict=True)]

        def slopes(x: np.ndarray) -> list[np.ndarray]:
            moved = zip(*map(errors, x + np.diag(steps)), strict=True)
            rests = zip(errors(x), moved, strict=True)
            return [(np.column_stack(m) - r[:, None]) / steps for r, m in rests]

        before, cost = np.inf, self.cost(x, cause)
        while before - cost > GOOD_ENOUGH:
            sizes = np.sqrt(list(self._noise(self.rests(cause, x)).values()))
            end = descend(errors, slopes, x, limits, most=3)
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
    """What a regression on rows (k, M) and a constant leaves of y (M,)."""
    y, A = y - y.mean(), rows - rows.mean(axis=1, keepdims=True)
    sizes = np.sqrt(np.einsum("km,km->k", A, A))
    A = A / np.where(sizes > 0.0, sizes, 1.0)[:, None]
    # Few columns that were scaled: squaring their condition costs digits below any noise.
    part, *_ = np.linalg.lstsq(A @ A.T, A @ y, rcond=None)
    return np.asarray(y - part @ A)
