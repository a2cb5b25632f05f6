"""Which channel is late, or on another clock, with the stiffness and the friction left free.

Each channel in turn is taken for late, by a lag or by one that grows from nothing (two clocks that
start together), and the links' stiffness and damping are fitted beside it. The cause is the one
that explains most. Nothing that a newcomer's scenario has wrong takes part: stiffness is fitted,
gains and friction are coefficients of a regression.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from core.check.bending import LIGHT, Bending, Shape
from core.check.measured import Measured, lattice_step
from core.recording.channels import DRIVES, Role, is_reference, role_of

STARTS = tuple(np.geomspace(0.2, 5.0, 13))
"""Times the stated stiffness at which a fit may begin: estimates from a drawing are a factor of 4
off, and a resonance shows to a fit that begins within some ten per cent of its frequency."""
NEAR = 0.1
"""In ln, by which two beginnings differ that lead to the same end: resonances 5 % apart."""
LAGS = (1.0, 2.0, 4.0, 7.0, 10.0, 13.0, 16.0)
"""Samples of lag at which a fit may begin: it finds what is within half a period of it."""
GROWN = (-20.0, -8.0, -3.0, -1.0, 1.0, 3.0, 8.0, 20.0)
"""The same at the end of a recording, where the lag grows."""
STEPS = 10
"""Of a fit at most."""
CLOSEST = 3
"""Causes, of all that were scanned, that are fitted."""
FINE = 1e-3
"""Of a channel's spread, below which no model is right."""
ALIKE = 10.0
"""Neighbouring errors are alike: one in so many is independent."""
EDGE = 20
"""Samples left out at both ends, where a shifted channel has no values."""
KEPT = 8
"""Answers of the links that are kept: two shapes, and the differences of a fit."""
MOST = 3000
"""Samples of a fit; more of them are thinned."""
STIFFEST, LIGHTEST = np.log(30.0), (np.log(1e-5), np.log(0.3))
"""Bounds of the logarithms: beyond 30 times no link shows whether it is stiff or rigid."""


@dataclass(frozen=True)
class Cause:
    """Channels that may be late together; `grows`: by a lag that grows from nothing."""

    channels: tuple[str, ...] = ()
    grows: bool = False


@dataclass(frozen=True)
class Late:
    """What explains most."""

    cause: Cause
    size: float
    """s; where it grows s/s"""
    error: float
    """Its standard deviation."""
    left: float
    """Share of what remained unexplained that still does, in the channel that gains most."""


@dataclass(frozen=True)
class Judged:
    """The links as they are, and the best of all causes."""

    shape: Shape
    explained: dict[str, float]
    """Channel -> share of its variance, with the best cause."""
    late: Late | None
    """What explains most; None where no lag explains anything."""


def link_fit(found: Measured) -> LinkFit | None:
    """The fit of the links that a recording shows, made once; None where it shows none of them."""
    if LinkFit not in found.derived:
        links = Bending.of(found)
        made = None if links is None else LinkFit(links)
        found.derived[LinkFit] = made if made is not None and made.names else None
    fit = found.derived[LinkFit]
    return fit if isinstance(fit, LinkFit) else None


def judge(problem: LinkFit, others: Sequence[Shape] = ()) -> Judged:
    """The stiffness of the links, and the channel whose lag explains most.

    Args:
        others: The same links as other recordings show them, where a fit may begin as well.
    """
    tried = [problem.alone]
    if others:
        tried.append(problem.fitted(Cause(), problem.middle(others)))
    plain = min(tried, key=lambda x: problem.cost(problem.rests(Cause(), x)))
    begins = _apart([plain, *tried, *([problem.middle(others)] if others else [])])
    before = problem.rests(Cause(), plain)
    scanned = [(problem.scanned(cause, begins), cause) for cause in problem.causes()]
    best, chosen, least = plain, Cause(), problem.cost(before)
    better = [one for one in scanned if one[0][0] < least]
    closest = sorted(better, key=lambda one: one[0][0])[:CLOSEST]
    for (_, start), cause in closest:
        found = problem.fitted(cause, start)
        cost = problem.cost(problem.rests(cause, found))
        if cost < least:
            best, chosen, least = found, cause, cost
    after = problem.rests(chosen, best)
    explained = {n: 1.0 - float(np.var(r) / problem.spread(n)) for n, r in after.items()}
    if not chosen.channels:
        problem.forget()
        return Judged(problem.shape(best), explained, None)
    left = min(float(np.var(after[n]) / max(np.var(before[n]), 1e-300)) for n in after)
    late = Late(chosen, problem.size(chosen, best), problem.deviation(chosen, best), left)
    problem.forget()
    return Judged(problem.shape(best), explained, late)


def _apart(begins: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Without those that lead to where an earlier one does."""
    kept: list[np.ndarray] = []
    for one in begins:
        if all(np.max(np.abs(one - other)) > NEAR for other in kept):
            kept.append(one)
    return kept


@dataclass(frozen=True)
class LinkFit:
    """Stiffness and damping of the links of one recording, and how late a channel is.

    Unknowns: logarithms of stiffnesses and damping; with a cause its lag in samples (at the
    end, where it grows)."""

    links: Bending
    _known: dict[str, np.ndarray] = field(default_factory=dict)
    _smoothed: dict[str, np.ndarray] = field(default_factory=dict)
    _floors: dict[str, float] = field(default_factory=dict)
    _answers: dict[tuple[object, ...], dict[str, np.ndarray]] = field(default_factory=dict)

    @cached_property
    def segments(self) -> int:
        """How many of the links bend."""
        return int(self.links.segments.max()) + 1

    @cached_property
    def names(self) -> list[str]:
        """The channels that are explained."""
        shape = Shape(np.ones(self.segments), LIGHT)
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
    def alone(self) -> np.ndarray:
        """The unknowns without a cause."""
        return self.fitted(Cause(), self._begin())

    def middle(self, others: Sequence[Shape]) -> np.ndarray:
        """The unknowns at the median of other recordings' links."""
        logs = [np.log([*one.stiffness, one.damping]) for one in others]
        return np.asarray(np.median(logs, axis=0))

    @cached_property
    def places(self) -> list[str]:
        """The encoders."""
        return [f"theta{k + 1}" for k in range(self.links.model.arm.joints)]

    def _begin(self) -> np.ndarray:
        """The unknowns at the best common factor of the stiffness, then of each segment's own."""
        best = np.array([*np.zeros(self.segments), np.log(LIGHT)])
        common = slice(0, self.segments)
        for which in (common, *range(self.segments)) if self.segments > 1 else (common,):
            tried = []
            for factor in STARTS:
                one = best.copy()
                one[which] = np.log(factor) + (0.0 if which is common else best[which])
                tried.append(self._bounded(one))
            best = min(tried, key=lambda x: self.cost(self.rests(Cause(), x)))
        return best

    def causes(self) -> list[Cause]:
        """Channels that may be late, in both ways; a reference that was written is not."""
        groups: list[tuple[str, ...]] = [
            (n,) for n in (*self.places, *self.names) if not is_reference(n)
        ]
        groups += [("z1", "z2")] if {"z1", "z2"} <= set(self.names) else []
        return [Cause(group, grows) for group in groups for grows in (False, True)]

    @cached_property
    def shape_alone(self) -> Shape:
        """The links where all channels are taken for punctual."""
        found = self.shape(self.alone)
        self.forget()
        return found

    def forget(self) -> None:
        """Lets the answers of the links go, megabytes that only a fit needs: what is found stays as
        long as its recording."""
        self._answers.clear()

    def shape(self, x: np.ndarray) -> Shape:
        """Of the links."""
        return Shape(np.exp(x[: self.segments]), float(np.exp(x[self.segments])))

    def size(self, cause: Cause, x: np.ndarray) -> float:
        """s; where it grows s/s"""
        if not cause.channels:
            return 0.0
        return float(x[-1]) * (1.0 / len(self.links.q) if cause.grows else self.links.found.step)

    def scanned(self, cause: Cause, begins: Sequence[np.ndarray]) -> tuple[float, np.ndarray]:
        """(cost, unknowns) at the best of the lags at which a fit may begin."""
        tried = [np.array([*x, lag]) for x in begins for lag in (GROWN if cause.grows else LAGS)]
        costs = [self.cost(self.rests(cause, one)) for one in tried]
        return min(costs), tried[int(np.argmin(costs))]

    def cost(self, rests: dict[str, np.ndarray]) -> float:
        """Twice the negative log-likelihood at the noise that each channel shows, per sample."""
        return sum(float(np.log(np.mean(r**2) + self._least(n))) for n, r in rests.items())

    def _least(self, name: str) -> float:
        """The variance below which an error says nothing: rounding, noise, the model's own."""
        if name not in self._floors:
            y = self._channel(name)
            self._floors[name] = lattice_step(y) ** 2 / 12.0 + (FINE * float(np.std(y))) ** 2
        return self._floors[name]

    def spread(self, name: str) -> float:
        """Variance of a channel."""
        return max(float(np.var(self._channel(name))), 1e-300)

    def _channel(self, name: str) -> np.ndarray:
        if name not in self._known:
            self._known[name] = self.links.channel(name)
        return self._known[name]

    def rests(self, cause: Cause, x: np.ndarray) -> dict[str, np.ndarray]:
        """What remains of each channel (m,) while the cause is as large as x says."""
        shape = self.shape(x)
        t, size = self.links.grid, self.size(cause, x)
        when = t + size * (t - t[0] if cause.grows else 1.0)

        def punctual(name: str, values: np.ndarray) -> np.ndarray:
            return np.interp(when, t, values) if name in cause.channels else values

        places = {n: punctual(n, q) for n, q in zip(self.places, self.links.q.T, strict=True)}
        late = size if any(n in cause.channels for n in self.places) else 0.0
        key = (shape.stiffness.tobytes(), shape.damping, cause if late else None, late)
        answers = self._kept(key, shape, np.column_stack(list(places.values())))
        edge = min(EDGE, len(t) // 5)
        thin = slice(edge, len(t) - edge, max(len(t) // MOST, 1))
        at, made = (t - (when - t))[thin], {}
        for n, rows in answers.items():
            y, own = self._channel(n), n in cause.channels
            if n in self.driven:
                y = self.links.held(punctual(n, y)) if own else self._held(n)
            elif own:
                # The answer is moved and not the measurement, whose noise would shrink between
                # the samples and draw the lag there.
                made[n] = _unexplained(y[thin], np.array([np.interp(at, t, each) for each in rows]))
                continue
            made[n] = _unexplained(y[thin], rows[:, thin])
        return made

    def _held(self, name: str) -> np.ndarray:
        if name not in self._smoothed:
            self._smoothed[name] = self.links.held(self._channel(name))
        return self._smoothed[name]

    def _kept(self, key: tuple[object, ...], shape: Shape, q: np.ndarray) -> dict[str, np.ndarray]:
        """What explains each channel, as rows (k, M) of a regression; the last ones are kept, as
        a lag of a channel alone changes none of them."""
        if key not in self._answers:
            while len(self._answers) >= KEPT:
                self._answers.pop(next(iter(self._answers)))
            whole, ringing = self.links.moved(shape, q), self.links.ringing(shape)
            made = {n: np.array([y, *ringing]) for n, y in self.links.sensed(whole).items()}
            if any(n in self.names for n in self.driven):
                torques = self.links.torques(whole)
                speed, dry = self.links.rubbed(q)
                smooth = list(self.links.smooth(np.array(ringing).T).T) if ringing else []
                made |= {
                    n: np.array([torques[:, k], speed[:, k], dry[:, k], *smooth])
                    for k, n in enumerate(self.driven)
                    if n in self.names
                }
            self._answers[key] = made
        return self._answers[key]

    def fitted(self, cause: Cause, x: np.ndarray) -> np.ndarray:
        """Gauss-Newton on the logarithms of the channels' errors, damped where it overshoots."""
        rests, damped = self.rests(cause, x), 1e-3
        cost = self.cost(rests)
        for _ in range(STEPS):
            J, r = self._weighted(cause, x, rests)
            H, g = J.T @ J, J.T @ r
            for _ in range(4):
                step = np.linalg.solve(
                    H + damped * (np.diag(np.diag(H)) + 1e-9 * np.eye(len(x))), g
                )
                tried = self._bounded(x - np.clip(step, -1.0, 1.0) * self._strides(x))
                new = self.rests(cause, tried)
                if (better := self.cost(new)) < cost:
                    break
                damped *= 10.0
            else:
                return x
            x, rests, damped = tried, new, damped / 10.0
            cost, before = better, cost
            if before - cost < 1e-3:
                break
        return x

    def _strides(self, x: np.ndarray) -> np.ndarray:
        """Of each unknown, for a step of one: half the stiffness, threefold damping, six samples
        of lag."""
        return np.array([0.5] * self.segments + [1.0] + [6.0] * (len(x) - self.segments - 1))

    def _bounded(self, x: np.ndarray) -> np.ndarray:
        s = self.segments
        stiffness = np.clip(x[:s], -STIFFEST, STIFFEST)
        return np.array([*stiffness, np.clip(x[s], *LIGHTEST), *x[s + 1 :]])

    def _weighted(
        self, cause: Cause, x: np.ndarray, rests: dict[str, np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray]:
        """(J, r) by differences, in strides and in the errors' own standard deviations."""
        strides, columns = self._strides(x), []
        sizes = {n: np.sqrt(np.mean(r**2) + self._least(n)) for n, r in rests.items()}
        r = np.concatenate([rests[n] / sizes[n] for n in rests])
        for k, stride in enumerate(strides):
            moved = x.copy()
            moved[k] += 0.02 * stride
            other = self.rests(cause, moved)
            columns.append((np.concatenate([other[n] / sizes[n] for n in rests]) - r) / 0.02)
        return np.column_stack(columns), r

    def deviation(self, cause: Cause, x: np.ndarray) -> float:
        """Standard deviation of the cause's size."""
        J, _ = self._weighted(cause, x, self.rests(cause, x))
        spread = np.sqrt(ALIKE * np.abs(np.diag(np.linalg.pinv(J.T @ J))))
        moved = x.copy()
        moved[-1] = spread[-1] * self._strides(x)[-1]
        return abs(self.size(cause, moved))


def _unexplained(y: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """What a regression on rows (k, M) and a constant leaves of y (M,)."""
    y, A = y - y.mean(), rows - rows.mean(axis=1, keepdims=True)
    sizes = np.sqrt(np.einsum("km,km->k", A, A))
    A = A / np.where(sizes > 0.0, sizes, 1.0)[:, None]
    # Few columns that were scaled: squaring their condition costs digits below any noise.
    part, *_ = np.linalg.lstsq(A @ A.T, A @ y, rcond=None)
    return np.asarray(y - part @ A)
