"""Figures of a diagnosis in plain words."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from core.diagnose.verdict import ABOVE, Remains
from core.results import ChannelError, Estimate, LadderStep, RankedEffect
from core.sentences import listed
from core.written import channel_symbol, format_number, quantity

VERY_STRONG, STRONG, POSITIVE = 10.0, 6.0, 2.0
"""Differences of BIC and what they are called (Kass & Raftery 1995)."""

ENDLESS = 1000.0
"""A difference of BIC above this is only said to be above it."""

CERTAIN = 1e-9
"""A chance below this is only said to be below it."""

ASIDE = "("
"""Begins what is said in a lower voice; no effect's title holds it."""

LABEL = "the diagnosis, starts free"
"""Of its fit; an identification holds the starts on the encoders' first samples."""

LEFT_BY_ALL = (
    "what even a complete model would not explain: sensor noise and a small modelling tolerance"
)
"""The floor in plain words."""

FLOOR_IS = f"The noise floor is {LEFT_BY_ALL}."


def times(ratio: float) -> str:
    """'18 times'; two digits say enough."""
    return f"{format_number(ratio, 2, keep_zeros=True)} times"


def percent(share: float) -> str:
    """'46 %', 'more than 99.9 %'; never more than was found."""
    if share > 99.9:
        return "more than 99.9 %"
    if share < 1.0:
        return "less than 1 %"
    return f"{share:.1f} %" if share > 99.0 else f"{share:.0f} %"


LEAST_SHARE = 0.05
"""Per cent of the error: less is written as 0.0 and explains nothing."""

NEUTRAL = 1e-6
"""Of the distance between the bounds: a size within it of nothing at all is none."""


def share_of(ranked: RankedEffect) -> float:
    """Per cent that an effect explains: by its refit, or what the screen expects."""
    refitted = ranked.refit_drop_percent
    return ranked.expected_drop_percent if refitted is None else refitted


ORDER = (
    "Order: what was added or is named as missing, then by what is explained after refitting, then "
    "by the estimate; last what cannot be distinguished from the model's own parameters."
)


def in_order(ranking: Sequence[RankedEffect], named: str | None = None) -> tuple[RankedEffect, ...]:
    """As a reader is shown them, in the ORDER that is stated beside the list."""

    def place(one: RankedEffect) -> tuple[bool, bool, bool, float]:
        unfitted = one.refit_drop_percent is None
        return one.effect != named, bool(one.tied_to), unfitted, -share_of(one)

    return tuple(sorted(ranking, key=place))


def tie(ranked: RankedEffect) -> str:
    """'cannot be distinguished from m1, which would go from 95 kg to 190.0 ± 0.2 kg'; empty where
    it can."""
    moved = [
        f"{e.name}, which would go from {quantity(e.start, e.unit, 4)} to {e.text}"
        for e in ranked.tied_to
    ]
    return f"cannot be distinguished from {listed(moved)}" if moved else ""


def worth_listing(ranking: Sequence[RankedEffect]) -> list[RankedEffect]:
    """Without those that explain nothing, and without those that vanished when refitted: what
    these seem to explain is something else that moved meanwhile."""
    return [r for r in ranking if share_of(r) >= LEAST_SHARE and not _vanished(r.parameters)]


def _vanished(sizes: Sequence[Estimate]) -> bool:
    return bool(sizes) and all(
        e.value == 0.0 or (e.at_bound and abs(e.value) <= NEUTRAL * (e.upper - e.lower))
        for e in sizes
    )


def strength(delta_bic: float) -> str:
    """The grade of an evidence."""
    if delta_bic > VERY_STRONG:
        return "very strong"
    if delta_bic > STRONG:
        return "strong"
    return "positive" if delta_bic > POSITIVE else "weak"


def evidence(delta_bic: float) -> str:
    """A difference of BIC; nobody needs to know how far above a thousand it is."""
    return f"over {ENDLESS:g}" if delta_bic > ENDLESS else format_number(delta_bic, 2)


def chance(p_value: float) -> str:
    """'less than one in a billion', 'about 1 in 300'."""
    if p_value < CERTAIN:
        return "less than one in a billion"
    if p_value >= 0.5:
        return "more than one in two"
    return f"about 1 in {format_number(1.0 / p_value, 2)}"


def how_sure(found: RankedEffect) -> str:
    """Chance and evidence of one effect."""
    text = (
        f"The probability that noise alone looks like this is {chance(found.p_value)}, "
        f"corrected for all trials"
    )
    if found.delta_bic is None:
        return f"{text}."
    return (
        f"{text}; the evidence, with a penalty for every parameter, is {strength(found.delta_bic)} "
        f"(ΔBIC {evidence(found.delta_bic)}, where above {VERY_STRONG:g} counts as very strong)."
    )


def size(estimate: Estimate, titles: dict[str, str]) -> str:
    """'Coulomb friction of joint 1 is 1.201 ± 0.001 N m'."""
    text = f"{titles.get(estimate.name, estimate.name)} is {estimate.text}"
    beside = estimate.at_bound and not estimate.undetermined
    return f"{text} (at its bound)" if beside else text


def how_big(sizes: Sequence[Estimate], titles: dict[str, str]) -> str:
    """All sizes of one effect with their standard deviations."""
    if not sizes:
        return "It has no size: it is in the model or it is not."
    text = listed([size(e, titles) for e in sizes])
    return f"{text[0].upper()}{text[1:]}."


COMPLETE = "The ±\N{NO-BREAK SPACE}values hold only if the model is complete."


def at_bounds(estimates: Sequence[Estimate], titles: Mapping[str, str]) -> str:
    """Parameters that ended where they may not go on; empty where none did."""
    stuck = [e for e in estimates if e.at_bound]
    if not stuck:
        return ""
    sentences = [
        f"{titles.get(e.name, e.name)} ended at its bound of {quantity(e.value, e.unit, 4)}"
        for e in stuck
    ]
    them = "it" if len(stuck) == 1 else "them"
    return f"{listed(sentences)}: widen {them} if that is plausible, else doubt the model."


def explained(found: RankedEffect, before: LadderStep, after: LadderStep | None) -> str:
    """The share of the error that one effect explains; of an error at the floor no share is."""
    text = "It explains {} of the error above the noise floor"
    if after is None:
        share = found.refit_drop_percent
        return "" if share is None else f"{text.format(percent(share))}."
    if math.sqrt(before.cost_per_sample) < ABOVE:
        return f"It is a small effect, seen in many samples: {fell(before, after)}."
    return f"{text.format(percent(share_between(before, after)))}: {fell(before, after)}."


def share_between(before: LadderStep, after: LadderStep) -> float:
    """Per cent of the squared error above the floor by which it falls between two steps."""
    drop = before.cost_per_sample - after.cost_per_sample
    return 100.0 * max(drop, 0.0) / max(before.cost_per_sample - 1.0, drop, 1e-300)


def fell(before: LadderStep, after: LadderStep) -> str:
    """How the error fell from one step to the next."""
    text = (
        f"the error falls from {times(math.sqrt(before.cost_per_sample))} the noise floor to "
        f"{times(math.sqrt(after.cost_per_sample))}"
    )
    if before.tip_rms is None or after.tip_rms is None:
        return text
    tips = [quantity(tip, "m", 2) for tip in (before.tip_rms, after.tip_rms)]
    if tips[0] == tips[1]:
        return text
    return f"{text}, and that of the tip from {tips[0]} to {tips[1]} rms"


def by_channel(left: Remains, step: LadderStep) -> str:
    """'θ₁ 1.0, z₁ 0.98 times the floor, and the tip is missed by 0.043 mm rms'."""
    parts = [f"{name} {ratio}" for name, ratio in _ratios(left)]
    return _and_tip(f"{listed(parts)} times the noise floor", "the tip is missed", step)


def misses(left: Remains, step: LadderStep) -> str:
    """'misses θ₁ by 10 and z₁ by 5.4 times the floor, and the tip by 0.20 mm rms'."""
    parts = [f"{name} by {ratio}" for name, ratio in _ratios(left)]
    return _and_tip(f"misses {listed(parts)} times the noise floor", "the tip", step)


def _and_tip(text: str, missed: str, step: LadderStep) -> str:
    if step.tip_rms is None:
        return text
    return f"{text}, and {missed} by {quantity(step.tip_rms, 'm', 2)} rms"


def _ratios(left: Remains) -> list[tuple[str, str]]:
    return [
        (channel_symbol(name), format_number(ratio, 2, keep_zeros=True))
        for name, ratio in left.by_channel.items()
    ]


def unseen_rms(errors: Sequence[ChannelError]) -> float | None:
    """Noise floors, over all channels, on recordings that no fit saw; None where there are none."""
    known = [e.validation_rms / e.floor for e in errors if math.isfinite(e.validation_rms)]
    return math.sqrt(sum(x * x for x in known) / len(known)) if known else None


def on_validation(errors: Sequence[ChannelError]) -> str:
    """The error on recordings that no fit saw; empty where there are none."""
    rms = unseen_rms(errors)
    if rms is None:
        return ""
    return f"On recordings that no fit has seen the error is {times(rms)} the noise floor."


def vibration(left: Remains) -> str:
    """A spectral line that stands out of what is left; empty where there is none."""
    if left.line is None:
        return ""
    channel, hz = left.line
    return (
        f"The error of {channel_symbol(channel)} contains a vibration of {format_number(hz, 3)} "
        f"Hz, far above the neighbouring frequencies: look for a machine that shakes the arm or "
        f"a part that vibrates by itself."
    )


def _furthest_apart(
    linear: Sequence[Estimate], full: Sequence[Estimate]
) -> tuple[Estimate, Estimate] | None:
    """What the data determine in both fits and is most different; None where they agree."""
    known = {e.name: e for e in full if e.identifiable and e.recording is None and e.value}
    pairs = [(e, known[e.name]) for e in linear if e.identifiable and e.name in known]
    far = [p for p in pairs if abs(p[0].value - p[1].value) > APART * abs(p[1].value)]
    return max(far, key=lambda p: abs(p[0].value / p[1].value - 1.0), default=None)


SAME = 1.05
"""Times the error of the full equations up to which the linear model is called as good: the two
are fitted to different outputs, which moves the tip's error by a few per cent."""


APART = 0.1
"""Relative: beyond it two fits stand in different places. What a linear model leaves out moves a
stiffness by a few per cents where that model is of use at all."""


def linear_line(
    linear: float | None,
    full: float | None,
    floor: float,
    fits: tuple[Sequence[Estimate], Sequence[Estimate]] = ((), ()),
) -> str:
    """What the linear model costs, m rms of the tip; a matter of the model, never of the arm.

    Args:
        linear: what it misses, None where nothing shows the tip.
        full: what the full equations miss.
        floor: noise of the tip.
        fits: estimates of both.
    """
    ours = "The diagnosis uses the full equations."
    if linear is None or full is None:
        return ours
    missed, least = quantity(linear, "m", 2), quantity(full, "m", 2)
    elsewhere = _furthest_apart(*fits)
    if elsewhere is not None:
        a, b = (quantity(e.value, e.unit, 3) for e in elsewhere)
        return (
            f"The diagnosis uses the full equations on every channel that was measured. Fitted so, "
            f"{elsewhere[0].name} is {b} instead of {a}, and the tip is missed by {least} rms "
            f"instead of {missed}."
        )
    if linear <= SAME * full:
        return (
            f"The linear model is as good as the full equations here: it misses the tip by "
            f"{missed} rms, they by {least}. {ours}"
        )
    beside = f"the full equations by {least}"
    if full <= ABOVE * floor:
        beside = f"the full equations do not: their {least} are at the noise floor"
    return (
        f"The linear model misses the tip by {missed} rms here; {beside}. This is a matter of the "
        f"model and no missing effect. {ours}"
    )


def aside(text: str) -> tuple[str, str]:
    """What a step's text says, and what it says in a lower voice."""
    message, mark, note = text.partition(ASIDE)
    return message.strip(), mark + note
