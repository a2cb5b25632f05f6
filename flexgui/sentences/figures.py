"""Figures of a diagnosis in plain words: errors, shares, evidence, sizes."""

from __future__ import annotations

import math
from collections.abc import Sequence

from flexgui.core.results import (
    ABOVE,
    ChannelError,
    Doubt,
    DoubtReason,
    Estimate,
    InformationCriteria,
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

FLOOR_IS = (
    "The noise floor is the error of a complete model: sensor noise and a small modelling "
    "tolerance."
)


def times(ratio: float) -> str:
    """'18 times': a ratio with two digits."""
    return f"{format_number(ratio, 2, keep_zeros=True)} times"


def percent(share: float) -> str:
    """'46 %', 'more than 99.9 %': a share in per cent, never rounded up to 100 %."""
    return short_percent(share).replace("> ", "more than ").replace("< ", "less than ")


def short_percent(share: float) -> str:
    """'46 %', '> 99.9 %' of a `share` in per cent: the same for narrow columns."""
    if not LITTLE <= share <= 99.9:
        return "< 1 %" if share < LITTLE else "> 99.9 %"
    return f"{share:.1f} %" if share > 99.0 else f"{share:.0f} %"


def strength(delta_bic: float) -> str:
    """Grade of the evidence by `delta_bic`, a difference of the criterion BIC."""
    if delta_bic > VERY_STRONG:
        return "very strong"
    if delta_bic > STRONG:
        return "strong"
    return "positive" if delta_bic > POSITIVE else "weak"


def evidence(delta_bic: float) -> str:
    """`delta_bic`, a difference of the criterion BIC, as text: 'over 1000' above ENDLESS."""
    return f"over {ENDLESS:g}" if delta_bic > ENDLESS else format_number(delta_bic, 2)


def chance(p_value: float) -> str:
    """A probability `p_value` in words: 'less than one in a billion', 'about 1 in 300'."""
    if p_value < CERTAIN:
        return "less than one in a billion"
    if p_value >= 0.5:
        return "more than one in two"
    return f"about 1 in {format_number(1.0 / p_value, 2)}"


def significance(ranked: RankedEffect) -> str:
    """Chance and evidence of one effect."""
    text = f"Probability of noise alone, corrected for all trials: {chance(ranked.p_value)}."
    if ranked.delta_bic is None:
        return text
    return (
        f"{text} Evidence, with a penalty for each parameter: {strength(ranked.delta_bic)} "
        f"(ΔBIC {evidence(ranked.delta_bic)}; above {VERY_STRONG:g} is very strong)."
    )


def sizes_sentence(sizes: Sequence[Estimate]) -> str:
    """All sizes of one effect with their standard deviations: 'Coulomb friction of joint 1 is
    1.201 ± 0.001 N m.'"""
    if not sizes:
        return "It has no parameters: it is in the model or it is not."
    text = listed([_size(e) for e in sizes])
    return f"{text[0].upper()}{text[1:]}."


def _size(e: Estimate) -> str:
    beside = " (at its bound)" if e.at_bound and not e.undetermined else ""
    return f"{e.title or e.name} is {estimate_text(e)}{beside}"


COMPLETE = "The ±\N{NO-BREAK SPACE}values hold only if the model is complete."


def at_bounds(estimates: Sequence[Estimate]) -> str:
    """Parameters that ended at a bound of their search; empty where none did."""
    stuck = [e for e in estimates if e.at_bound]
    if not stuck:
        return ""
    sentences = [
        f"{e.title or e.name} ended at its bound of {quantity(e.value, e.unit, 4)}" for e in stuck
    ]
    bounds = "this bound" if len(stuck) == 1 else "these bounds"
    return f"{listed(sentences)}. Widen {bounds} if that is plausible; otherwise doubt the model."


def explained(ranked: RankedEffect, before: LadderStep, after: LadderStep | None) -> str:
    """The share of the error that one effect explains; none of an error at the noise floor."""
    text = "It explains {} of the error above the noise floor"
    if after is None:
        share = ranked.refit_drop_percent
        return "" if share is None else f"{text.format(percent(share))}."
    if math.sqrt(before.cost_per_sample) < ABOVE:
        return f"It is a small effect, seen in many samples: {error_change(before, after)}."
    return f"{text.format(percent(share_between(before, after)))}: {error_change(before, after)}."


def share_between(before: LadderStep, after: LadderStep) -> float:
    """Per cent of the squared error above the floor by which it falls between two steps."""
    drop = before.cost_per_sample - after.cost_per_sample
    return 100.0 * max(drop, 0.0) / max(before.cost_per_sample - 1.0, drop, 1e-300)


def error_change(before: LadderStep, after: LadderStep) -> str:
    """'error from 19 to 1.0 times the noise floor, tip from 0.20 mm to 0.043 mm rms'."""
    was = format_number(math.sqrt(before.cost_per_sample), 2, keep_zeros=True)
    text = f"error from {was} to {times(math.sqrt(after.cost_per_sample))} the noise floor"
    if before.tip_rms is None or after.tip_rms is None:
        return text
    tips = [quantity(tip, "m", 2) for tip in (before.tip_rms, after.tip_rms)]
    if tips[0] == tips[1]:
        return text
    return f"{text}, tip from {tips[0]} to {tips[1]} rms"


def error_by_channel(remains: Remains, step: LadderStep) -> str:
    """'θ₁ 1.0 and z₁ 0.98 times the noise floor, tip 0.043 mm rms'; no tip without a camera."""
    parts = [
        f"{channel_symbol(name)} {format_number(ratio, 2, keep_zeros=True)}"
        for name, ratio in remains.by_channel.items()
    ]
    text = f"{listed(parts)} times the noise floor"
    return text if step.tip_rms is None else f"{text}, tip {quantity(step.tip_rms, 'm', 2)} rms"


def validation_rms(errors: Sequence[ChannelError]) -> float:
    """Error on validation over all channels, in noise floors; NaN without such recordings."""
    ratios = [e.validation_rms / e.floor for e in errors if math.isfinite(e.validation_rms)]
    return math.sqrt(sum(x * x for x in ratios) / len(ratios)) if ratios else math.nan


def validation_sentence(errors: Sequence[ChannelError]) -> str:
    """The error on validation recordings; empty where there are none."""
    rms = validation_rms(errors)
    return "" if math.isnan(rms) else f"On validation the error is {times(rms)} the noise floor."


CONTRADICTED = {
    DoubtReason.REFUTED_NOISE: (
        "the noise of {} was estimated, and the model leaves less than that ({})",
        "State {}, or record a motion twice.",
    ),
    DoubtReason.FLOOR_ABOVE_SPREAD: (
        "the noise floor of {} is above all that the recordings show of it ({})",
        "Record a larger motion, state a smaller noise, or leave the channel out.",
    ),
    DoubtReason.UNSEEN: (
        "on recordings that no fit has seen the error of {} is far above the noise floor ({})",
        "Fit some of those recordings too, and diagnose again.",
    ),
}
"""Why a model cannot be judged, and what is needed."""


def doubts_sentence(doubts: Sequence[Doubt], settings: str, missing: str = "something") -> str:
    """Why it cannot be judged what is `missing`, and what is needed; `settings`: of the noise, to
    state."""
    reasons = list(dict.fromkeys(d.reason for d in doubts))
    because, needed = [], []
    for reason in reasons:
        own = [d for d in doubts if d.reason is reason]
        channels = listed([channel_symbol(d.channel, d.unit) for d in own])
        text, advice = CONTRADICTED[reason]
        because.append(text.format(channels, _most_contradicted(own)))
        needed.append(advice.format(settings))
    why, advice = "; ".join(because), " ".join(needed)
    return f"It cannot be judged whether {missing} is missing: {why}. {advice}"


def _most_contradicted(doubts: Sequence[Doubt]) -> str:
    """Both numbers of the channel in which they differ most."""
    worst = max(doubts, key=lambda d: abs(math.log(max(d.beside, 1e-300) / d.floor)))
    numbers = (quantity(x, worst.unit, 2) for x in (worst.beside, worst.floor))
    most = f"most in {channel_symbol(worst.channel, worst.unit)}: " if len(doubts) > 1 else ""
    return most + " beside ".join(numbers)


def vibration(remains: Remains) -> str:
    """A spectral line that stands out of the residual; empty where there is none."""
    if remains.line is None:
        return ""
    channel, hz = remains.line
    return (
        f"The error of {channel_symbol(channel)} contains a vibration of {format_number(hz, 3)} "
        "Hz, far above the neighbouring frequencies. Look for a machine that shakes the arm or a "
        "part that vibrates."
    )


def linear_sentence(model: LinearModel) -> str:
    """What the linear model costs: a matter of the model, never of the arm."""
    uses = "The diagnosis uses the full equations."
    linear, full = model.tip_rms, model.full_equations_tip_rms
    if linear is None or full is None:
        return uses
    linear_rms, full_rms = quantity(linear, "m", 2), quantity(full, "m", 2)
    if model.moved is not None:
        before, after = (quantity(e.value, e.unit, 3) for e in model.moved)
        return (
            "The diagnosis uses the full equations on every measured channel. With them "
            f"{model.moved[0].name} is {after} instead of {before}; the tip error is {full_rms} "
            f"rms instead of {linear_rms}."
        )
    if linear <= SAME * full:
        return (
            f"The linear model is as good as the full equations here: its tip error is "
            f"{linear_rms} rms, theirs {full_rms}. {uses}"
        )
    at_floor = ", at the noise floor" if full <= ABOVE * model.tip_floor else ""
    return (
        f"The tip error is {linear_rms} rms with the linear model and {full_rms} with the full "
        f"equations{at_floor}. This comes from the linear model, not from a missing effect. {uses}"
    )


SAME = 1.05
"""Times the error of the full equations up to which the linear model is called as good: the two
are fitted to different outputs, which changes the tip error by a few per cent."""


def criteria_text(criteria: InformationCriteria | None) -> str:
    """'AIC −18804, BIC −18793, FPE 0.004'; empty without any."""
    if criteria is None:
        return ""
    aic, bic = (_criterion(value) for value in (criteria.aic, criteria.bic))
    return f"AIC {aic}, BIC {bic}, FPE {format_number(criteria.fpe, 3)}"


def _criterion(value: float) -> str:
    """To the unit, as differences of ten count; a huge one, far from any noise, to three digits."""
    return format_number(round(value), WHOLE if abs(value) < 10.0**WHOLE else 3)


WHOLE = 6
"""Digits of a criterion that are read."""
