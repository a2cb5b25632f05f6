"""Which channel is wrong if channels disagree: the one whose fault explains all."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..check.gain_and_lag import GAIN_EXPLAINED, LAG_EXPLAINED, LEAST_EXPLAINED, LOOP, Relation
from ..check.late_channels import LateResult
from ..recording.channels import DRIVES, Role, is_reference, role_of

SCALE = 0.12
"""|ln factor| below which a gain is friction, payload or calibration (scenarios/mujoco: gains of
one recording's channels are that close whatever is hidden)."""
LEAST_RATIO = 3.0
"""Least ratio of a fault to the disagreement of the other channels."""
ALIKE = 0.25
"""Share by which the relations of one channel may differ."""
FEW_SAMPLES = 2.0
"""Sample times of lag of a drive or filter without a fault."""
SURE_OF_CHANGE = 0.9
"""The same if other recordings show what is usual."""
DRIFT = 1e-3
"""s/s; quartz clocks differ by 1e-4 at most, elastic joints look like 6e-4."""
SURE_DRIFT = 6.0
"""Standard deviations."""
MAINLY = 0.5
"""Largest remaining share in a channel for a lag to be its cause."""
COMMAND = 0.1
"""In ln: of equal causes the sensor's comes first; programs write commands."""


@dataclass(frozen=True)
class Suspect:
    """A wrong channel; 1, 0 and 0 where it is right."""

    channel: str
    factor: float = 1.0
    """Factor on the value predicted by the others."""
    delay: float = 0.0
    """s"""
    drift: float = 0.0
    """s/s"""
    against: str = ""
    """The channels that contradict it."""
    expected: np.ndarray | None = None


@dataclass(frozen=True)
class _JudgedRelation:
    relation: Relation
    gain: float
    """ln |gain| beyond the usual one."""
    lag: float
    lag_tolerance: float
    drift: float
    gain_tolerance: float


def suspects(own: Sequence[Relation], others: Sequence[Sequence[Relation]]) -> tuple[Suspect, ...]:
    """The channels that contradict all others, by the recording's `own` relations. What the
    scenario's `others` agree on is the rig."""
    entries = [_judged(r, others) for r in own if r.explained > LEAST_EXPLAINED]
    if not entries:
        return ()
    every, entries = entries, list(_single(entries))
    gains = [
        e for e in entries if e.relation.tolerance != LOOP or e.relation.explained > GAIN_EXPLAINED
    ]
    gains = [e for e in gains if np.isfinite(e.relation.tolerance)]
    by_factor = _factors(gains)
    # With others to compare, what they do is no delay: a servo's lag, the rig's own dynamics.
    late = _delays(entries, SURE_OF_CHANGE, lambda e: e.lag) if len(others) > 1 else ()
    return (*by_factor, *(late or _delays(*_trusted(entries))), *_drifts(every))


def late_suspects(result: LateResult | None, step: float) -> tuple[Suspect, ...]:
    """Channels that are late whatever the links' stiffness; `step` in s. An early channel is none:
    another one is late then, and explains more."""
    if result is None or result.left > MAINLY or abs(result.size) < SURE_DRIFT * result.error:
        return ()
    if result.cause.grows:
        clear = abs(result.size) > DRIFT
        return tuple(
            Suspect(n, drift=result.size, against="the others")
            for n in result.cause.channels
            if clear
        )
    clear = result.size > FEW_SAMPLES * step
    return tuple(
        Suspect(n, delay=result.size, against="the others") for n in result.cause.channels if clear
    )


def contrast(own: Sequence[Relation], channel: str) -> float:
    """Factor of a channel in the loop beyond that of the other channels, which share its friction
    and payload; 1: none beyond their scatter."""
    loop = [_judged(r, ()) for r in own if r.tolerance == LOOP and r.explained > GAIN_EXPLAINED]
    touched = _touching(loop, [channel])
    others = [e.gain for e in loop if all(e is not one for one, _ in touched)]
    if not touched or not others:
        return 1.0
    usual = float(np.median(others))
    off = float(np.median([side * e.gain for e, side in touched])) - usual
    scatter = float(np.max(np.abs(np.array(others) - usual)))
    return float(np.exp(off)) if abs(off) > max(SCALE, LEAST_RATIO * scatter) else 1.0


def _single(entries: Sequence[_JudgedRelation]) -> Sequence[_JudgedRelation]:
    """Relations to single references; where these exist, those to all together are omitted."""
    judged_singly = {e.relation.output for e in entries if len(e.relation.inputs) == 1
             and e.relation.tolerance == LOOP}  # fmt: skip
    return [
        e for e in entries if len(e.relation.inputs) == 1 or e.relation.output not in judged_singly
    ]


def _trusted(
    entries: Sequence[_JudgedRelation],
) -> tuple[Sequence[_JudgedRelation], float, Callable[[_JudgedRelation], float]]:
    """Relations whose lag is reliable: of a current, and of a velocity loop that explains every
    encoder."""
    loop = [e for e in entries if e.relation.tolerance == LOOP]
    loop = [e for e in loop if all(role_of(n) is Role.SPEED for n in e.relation.inputs)]
    encoders = [e.relation.explained for e in loop if role_of(e.relation.output) is Role.PLACE]
    if min(encoders, default=0.0) < LAG_EXPLAINED:
        loop = []
    direct = [
        e for e in entries if role_of(e.relation.output) in DRIVES and e.relation.tolerance != LOOP
    ]
    return [*loop, *direct], LAG_EXPLAINED, lambda e: e.relation.lag


def _judged(relation: Relation, others: Sequence[Sequence[Relation]]) -> _JudgedRelation:
    alike = [
        r
        for each in others
        for r in each
        if r.key == relation.key and r.explained > LEAST_EXPLAINED
    ]
    logs = np.array([np.log(abs(r.gain)) for r in alike])
    lags = np.array([r.lag for r in alike if np.isfinite(r.lag)])
    log = float(np.log(abs(relation.gain)))
    # Only what is near the nominal is a habit of the rig; a unit wrong in all files is none.
    usual = float(np.median(logs)) if len(logs) >= 2 else 0.0
    habit = usual if abs(usual) <= max(relation.tolerance, 0.4) else 0.0
    lag = float(np.median(lags)) if len(lags) >= 2 else 0.0
    spread = float(np.ptp(lags)) if len(lags) >= 2 else 0.0
    tolerance = 1.5 * float(np.ptp(logs)) if len(logs) >= 2 else relation.tolerance
    return _JudgedRelation(
        relation, log - habit, relation.lag - lag, spread, relation.drift,
        max(tolerance, SCALE),
    )  # fmt: skip


def _touching(
    entries: Sequence[_JudgedRelation], group: Sequence[str]
) -> list[tuple[_JudgedRelation, int]]:
    """Relations with the group as output (+1) or as only input (-1), not both."""
    touched = []
    for entry in entries:
        out = entry.relation.output in group
        into = len(entry.relation.inputs) == 1 and entry.relation.inputs[0] in group
        if out != into:
            touched.append((entry, 1 if out else -1))
    return touched


def _channels(entries: Sequence[_JudgedRelation]) -> list[str]:
    """Channels, measured ones first: a sensor is wrong more often than a command."""
    names = {e.relation.output for e in entries}
    names |= {e.relation.inputs[0] for e in entries if len(e.relation.inputs) == 1}
    return sorted(names, key=lambda n: (is_reference(n), n))


def _names(entries: Sequence[_JudgedRelation], channel: str) -> str:
    """The channels on the other side of its relations."""
    names: list[str] = []
    for entry, side in _touching(entries, [channel]):
        names += entry.relation.inputs if side == 1 else (entry.relation.output,)
    return ", ".join(dict.fromkeys(names))


def _factors(entries: Sequence[_JudgedRelation]) -> tuple[Suspect, ...]:
    groups: list[tuple[str, ...]] = [(name,) for name in _channels(entries)]
    whole = [
        tuple(n for n in _channels(entries) if role_of(n) is role)
        for role in (Role.PLACE, Role.TIP)
    ]
    groups += [g for g in whole if len(g) > 1]
    best: tuple[float, tuple[str, ...], float] | None = None
    for group in groups:
        agreed = _explained(entries, group, lambda e: e.gain)
        if agreed is None:
            continue
        size, remaining = agreed
        limit = max(min(e.gain_tolerance for e, _ in _touching(entries, group)), SCALE)
        if abs(size) <= max(limit, LEAST_RATIO * remaining):
            continue
        if len(group) > 1 and abs(size) < np.log(20.0):
            continue  # only a unit is wrong in several channels alike
        score = (
            remaining - 0.02 * abs(size) * (size > np.log(5.0)) + COMMAND * is_reference(group[0])
        )
        if best is None or score < best[0]:
            best = (score, group, size)
    if best is None:
        return ()
    _, group, size = best
    return tuple(
        Suspect(name, factor=float(np.exp(size)), against=_names(entries, name)) for name in group
    )


def _explained(
    entries: Sequence[_JudgedRelation],
    group: Sequence[str],
    value: Callable[[_JudgedRelation], float],
) -> tuple[float, float] | None:
    """(size that the group's relations agree on, remaining disagreement); None if it has no
    relation."""
    touched = _touching(entries, group)
    if not touched:
        return None
    sizes = np.array([side * value(entry) for entry, side in touched])
    # The relations that are known best say how large it is.
    least = min(entry.relation.tolerance for entry, _ in touched)
    best = [entry.relation.tolerance <= least for entry, _ in touched]
    size = float(np.median(sizes[best]))
    mine = {id(entry) for entry, _ in touched}
    # Newton's law and nominal numbers leave more room than a loop that is known.
    deviations = [max(abs(value(e)) - _slack(e), 0.0) for e in entries if id(e) not in mine]
    deviations += [
        max(abs(s - size) - _slack(e), 0.0) for s, (e, _) in zip(sizes, touched, strict=True)
    ]
    return size, float(np.percentile(deviations, 80)) if deviations else 0.0


def _slack(entry: _JudgedRelation) -> float:
    return max(entry.relation.tolerance - 0.25, 0.0)


def _delays(
    entries: Sequence[_JudgedRelation], least: float, lag: Callable[[_JudgedRelation], float]
) -> tuple[Suspect, ...]:
    usable = [e for e in entries if e.relation.explained > LEAST_EXPLAINED and np.isfinite(lag(e))]
    sure = [e for e in usable if e.relation.explained > least]
    late: list[Suspect] = []
    names = _channels(sure)
    groups = [tuple(n for n in names if role_of(n) is Role.TIP), *((name,) for name in names)]
    for group in groups:
        touched = _touching(sure, group)
        if not touched or any(s.channel in group for s in late):
            continue
        sizes = np.array([side * lag(e) for e, side in touched])
        size = float(np.median(sizes))
        inner = {id(e) for e, _ in _touching(usable, group)}
        other_lags = [abs(lag(e)) for e in usable if id(e) not in inner]
        tolerance = max(e.lag_tolerance for e, _ in touched)
        step = _step(touched)
        alike = np.all(np.abs(sizes - size) <= max(ALIKE * abs(size), step))
        stands = size > max(
            FEW_SAMPLES * step, LEAST_RATIO * max(other_lags, default=0.0), 1.5 * tolerance
        )
        if (
            alike
            and stands
            and (len(group) == 1 or len({e.relation.output for e, _ in touched}) > 1)
        ):
            late += [
                Suspect(e.relation.output if side == 1 else group[0], delay=side * lag(e),
                        against=", ".join(e.relation.inputs), expected=e.relation.expected)
                for e, side in _one_each(touched)
            ]  # fmt: skip
    return tuple(late)


def _one_each(touched: Sequence[tuple[_JudgedRelation, int]]) -> list[tuple[_JudgedRelation, int]]:
    by_channel: dict[str, tuple[_JudgedRelation, int]] = {}
    for entry, side in touched:
        name = entry.relation.output if side == 1 else entry.relation.inputs[0]
        by_channel.setdefault(name, (entry, side))
    return list(by_channel.values())


def _step(touched: Sequence[tuple[_JudgedRelation, int]]) -> float:
    return max(entry.relation.step for entry, _ in touched)


def _drifts(entries: Sequence[_JudgedRelation]) -> tuple[Suspect, ...]:
    drifting = []
    for entry in entries:
        r = entry.relation
        clear = abs(r.drift) > max(DRIFT, SURE_DRIFT * r.drift_error)
        if clear and r.explained > LAG_EXPLAINED and np.isfinite(r.drift_error):
            drifting.append(Suspect(r.output, drift=r.drift, against=", ".join(r.inputs),
                                 expected=r.expected))  # fmt: skip
    names = {e.relation.output for e in entries if np.isfinite(e.relation.drift_error)}
    # Where all channels drift, the clock of the references or the model is another one.
    return tuple(drifting) if len({s.channel for s in drifting}) < max(len(names), 2) else ()
