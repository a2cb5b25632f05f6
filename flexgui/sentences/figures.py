"""Figures of a diagnosis in plain words: errors, shares, evidence, sizes."""

from __future__ import annotations

import math
from collections.abc import Sequence

from flexgui.core.results import (
    ABOVE,
    ChannelError,
    Estimate,
    LadderStep,
    LinearModel,
    RankedEffect,
    Remains,
)
from flexgui.core.sentences import listed
from flexgui.sentences.written import channel_symbol, estimate_text, format_number, quantity

VERY_STRONG, STRONG, POSITIVE = 10.0, 6.0, 2.0
"""Differences of BIC and what they are called (Kass & Raftery 1995)."""

ENDLESS = 1000.0
"""A difference of BIC above this is only said to be above it."""

LITTLE = 1.0
"""Per cent: a smaller share is only said to be smaller."""

CERTAIN = 1e-9
"""A chance below this is only said to be below it."""

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
    return short_percent(share).replace("> ", "more than ").replace("< ", "less than ")


def short_percent(share: float) -> str:
    """'46 %', '> 99.9 %': the same where there is little room."""
    if not LITTLE <= share <= 99.9:
        return "< 1 %" if share < LITTLE else "> 99.9 %"
    return f"{share:.1f} %" if share > 99.0 else f"{share:.0f} %"


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


def how_big(sizes: Sequence[Estimate]) -> str:
    """All sizes of one effect with their standard deviations: 'Coulomb friction of joint 1 is
    1.201 ± 0.001 N m.'"""
    if not sizes:
        return "It has no size: it is in the model or it is not."
    text = listed([_size(e) for e in sizes])
    return f"{text[0].upper()}{text[1:]}."


def _size(e: Estimate) -> str:
    beside = " (at its bound)" if e.at_bound and not e.undetermined else ""
    return f"{e.title or e.name} is {estimate_text(e)}{beside}"


COMPLETE = "The ±\N{NO-BREAK SPACE}values hold only if the model is complete."


def at_bounds(estimates: Sequence[Estimate]) -> str:
    """Parameters that ended where they may not go on; empty where none did."""
    stuck = [e for e in estimates if e.at_bound]
    if not stuck:
        return ""
    sentences = [
        f"{e.title or e.name} ended at its bound of {quantity(e.value, e.unit, 4)}" for e in stuck
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


BY_CHANNEL = ("{} {}", "{} times the noise floor", "the tip is missed")
"""'θ₁ 1.0, z₁ 0.98 times the floor, and the tip is missed by 0.043 mm rms'"""
MISSES = ("{} by {}", "misses {} times the noise floor", "the tip")
"""'misses θ₁ by 10 and z₁ by 5.4 times the floor, and the tip by 0.20 mm rms'"""


def by_channel(left: Remains, step: LadderStep, form: tuple[str, str, str]) -> str:
    """The error of each channel, and of the tip where it was seen; `form`: one of these two."""
    each, all_of_them, tip = form
    parts = [
        each.format(channel_symbol(name), format_number(ratio, 2, keep_zeros=True))
        for name, ratio in left.by_channel.items()
    ]
    text = all_of_them.format(listed(parts))
    if step.tip_rms is None:
        return text
    return f"{text}, and {tip} by {quantity(step.tip_rms, 'm', 2)} rms"


def unseen_rms(errors: Sequence[ChannelError]) -> float:
    """Noise floors, over all channels, on recordings that no fit saw; NaN where there are none."""
    known = [e.validation_rms / e.floor for e in errors if math.isfinite(e.validation_rms)]
    return math.sqrt(sum(x * x for x in known) / len(known)) if known else math.nan


def on_validation(errors: Sequence[ChannelError]) -> str:
    """The error on recordings that no fit saw; empty where there are none."""
    rms = unseen_rms(errors)
    if math.isnan(rms):
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


def linear_sentence(found: LinearModel) -> str:
    """What the linear model costs: a matter of the model, never of the arm."""
    ours = "The diagnosis uses the full equations."
    linear, full = found.tip_rms, found.full_equations_tip_rms
    if linear is None or full is None:
        return ours
    missed, least = quantity(linear, "m", 2), quantity(full, "m", 2)
    if found.moved is not None:
        a, b = (quantity(e.value, e.unit, 3) for e in found.moved)
        return (
            f"The diagnosis uses the full equations on every channel that was measured. Fitted so, "
            f"{found.moved[0].name} is {b} instead of {a}, and the tip is missed by {least} rms "
            f"instead of {missed}."
        )
    if linear <= SAME * full:
        return (
            f"The linear model is as good as the full equations here: it misses the tip by "
            f"{missed} rms, they by {least}. {ours}"
        )
    beside = f"the full equations by {least}"
    if full <= ABOVE * found.tip_floor:
        beside = f"the full equations do not: their {least} are at the noise floor"
    return (
        f"The linear model misses the tip by {missed} rms here; {beside}. This is a matter of the "
        f"model and no missing effect. {ours}"
    )


SAME = 1.05
"""Times the error of the full equations up to which the linear model is called as good: the two
are fitted to different outputs, which moves the tip's error by a few per cent."""
