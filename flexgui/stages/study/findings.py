"""What follows from the figures of a study, in words; every sentence is made of numbers that were
found.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from flexgui.core.montecarlo import printed
from flexgui.core.montecarlo.estimates import (
    WITHIN,
    EstimateTable,
    ValleyPrior,
    agreements,
    comparable,
    explained,
    implied_bias,
    least_scatter,
    pooled,
)
from flexgui.core.montecarlo.planning import Planning
from flexgui.core.montecarlo.printed import Numbers
from flexgui.core.montecarlo.summary import LEVELS, BiasSource, Summary, Validation
from flexgui.core.sentences import listed
from flexgui.sentences.written import format_number
from flexgui.stages.study.baselines import about_baselines, plus, snr

Finding = tuple[str, str]
"""Heading and paragraph."""


Compared = Sequence[tuple[EstimateTable, Sequence[Numbers]]]
"""Tables that can be laid beside the paper's, with its numbers."""


def findings(s: Summary) -> Iterator[Finding]:
    """As many as the finished parts allow, in the order of a report."""
    clean = next((t for t in s.tables if t.snr_db is None and t.runs > 1), None)
    both = [(t, published) for t in s.tables if (published := comparable(t)) is not None]
    if clean is not None:
        yield from _about_valley(clean)
        if s.prior is not None:
            yield "Why ε and d scatter as they do", _about_prior(clean, s.prior)
    yield from _about_means(s.tables)
    if both:
        sentences = (_size(both, s.true_EI), *_candidate(both, s.bias, s.true_EI))
        yield "The bias in EI that the paper's means imply", " ".join(sentences)
    yield from _about_scatter(both)
    yield from _about_deviation_of_mean(both)
    if s.validation is not None:
        yield "Validation sweeps", _about_sweeps(s.validation)
    yield from about_baselines(s.baselines)
    if s.planning is not None and s.planning.chosen:
        yield "Which experiments to make", _about_planning(s.planning)


def ratio_of_deviations(table: EstimateTable) -> float:
    """Smallest over the fits: relative deviation of ε over that of EI."""
    ratios = []
    for row in (*table.locals, table.row("glocal")):
        epsilon, EI = row.values["epsilon"], row.EI[0]
        ratios.append((epsilon.std / epsilon.mean) / max(EI.std / EI.mean, 1e-300))
    return min(ratios)


def _about_valley(table: EstimateTable) -> Iterator[Finding]:
    if {"epsilon", "d"} != set(table.rows[0].values):
        return
    glocal = table.row("glocal")
    epsilon, EI = glocal.values["epsilon"], glocal.EI[0]
    yield (
        "What the data fix",
        f"The model contains ε and d only as EI = ε d⁴ / 12. Without noise the {table.runs} runs "
        f"end anywhere along the valley ε d⁴ = const, so that ε scatters by "
        f"{100.0 * epsilon.std / epsilon.mean:.1f} % (glocal), while EI scatters by "
        f"{100.0 * EI.std / EI.mean:.1g} %: in every fit at least "
        f"{ratio_of_deviations(table):.0f} times less. A table of ε and d therefore shows the "
        f"search and its first population; a table of EI shows the data.",
    )


def _about_prior(table: EstimateTable, prior: ValleyPrior) -> str:
    single = [e for e in explained(table, prior) if e.label != "local mean"]
    good = sum(e.good for e in single)
    pool = {e.name: e for e in pooled(table, prior)}
    flat, searched = prior.flat["epsilon"], prior.searched["epsilon"]
    text = (
        f"The uniform prior, cut along the valley, has a deviation of "
        f"{flat.std * 1e-9:.4f} GPa in ε and {prior.flat['d'].std * 1e3:.2f} mm in d. The search "
        f"draws the population together while it moves along the bent valley; the same search on "
        f"the bare product ε d⁴, without any arm or data, ends with {searched.std * 1e-9:.4f} GPa "
        f"and {prior.searched['d'].std * 1e3:.2f} mm ({prior.draws} draws). Found at SNR ∞ over "
        f"all fits: {pool['epsilon'].found * 1e-9:.4f} GPa ({pool['epsilon'].ratio:.2f} of that, "
        f"{pool['epsilon'].found / flat.std:.2f} of the prior without the search) "
        f"and {pool['d'].found * 1e3:.2f} mm ({pool['d'].ratio:.2f}); fit by fit {good} of "
        f"{len(single)} deviations lie within {100.0 * WITHIN:.0f} %."
    )
    published = comparable(table)
    if published is None:
        return text
    squares = [published[k][1] ** 2 for k in (*printed.LOCALS, printed.GLOCAL)]
    paper = float(np.sqrt(np.mean(squares)))
    ratio = paper / (flat.std * 1e-9)
    text += (
        f" The paper's own deviations at SNR ∞ ({paper:.4f} GPa in root mean square) are "
        f"{ratio:.2f} times that of the prior cut along the valley."
    )
    if abs(ratio - 1.0) <= WITHIN:
        text += " They say how wide the first population was, not how well ε is known."
    return text


def _about_means(tables: Sequence[EstimateTable]) -> Iterator[Finding]:
    found = agreements(tables)
    if not found:
        return
    missed = [a for a in found if not a.within]
    good = len(found) - len(missed)
    text = f"{good} of {len(found)} means lie within one of the paper's deviations."
    if missed:
        names = {"epsilon": "ε", "d": "d"}
        each = [
            f"{names[a.name]} {a.label} at {snr(a.snr_db)} ({a.ours:.4g}, paper "
            f"{a.paper:.4g} ± {a.deviation:.3g})"
            for a in missed
        ]
        text += (
            f" Outside: {listed(each)}. Where both means of a fit cannot lie on the valley of the "
            f"true EI, no unbiased estimate can meet them both."
        )
    yield "Means beside the paper's", text


def _about_scatter(both: Compared) -> Iterator[Finding]:
    for table, published in both:
        if table.snr_db is None or table.runs < 2:
            continue
        least = [100.0 * least_scatter(published[k]) for k in (*printed.LOCALS, printed.GLOCAL)]
        rows = (*table.locals, table.row("glocal"))
        ours = [100.0 * row.EI[0].std / row.EI[0].mean for row in rows]
        yield (
            f"Scatter off the valley at {snr(table.snr_db)}",
            f"In the paper d scatters more than the valley allows: its deviations of ε and d imply "
            f"that EI scatters by at least {min(least):.1f} to {max(least):.1f} % between runs "
            f"({float(np.median(least)):.1f} % in the middle). White noise of this ratio on the "
            f"velocities gives {min(ours):.2f} to {max(ours):.2f} % here, so it does not explain "
            f"that; searches that end above the bottom of the valley would, and so would the "
            f"larger noise of velocities that are differentiated from noisy positions.",
        )


def _about_deviation_of_mean(both: Compared) -> Iterator[Finding]:
    parts = []
    for table, published in both:
        each = [published[k][1] for k in printed.LOCALS]
        right, caption = printed.deviation_of_mean(each), printed.caption_deviation(each)
        parts.append(
            f"at {snr(table.snr_db)} sqrt(Σ std²)/δ = {right:.4f} and sqrt(Σ std²/δ) = "
            f"{caption:.4f}, printed {published[printed.MEAN][1]:.4f}"
        )
    if parts:
        yield (
            "The deviation of the mean",
            f"From the paper's local deviations of ε (GPa): {'; '.join(parts)}. The printed "
            f"numbers obey the first formula, the caption states the second.",
        )


def _about_sweeps(checked: Validation) -> str:
    fits = [(name, *checked.mean(level)) for level, name in LEVELS.items()]
    parts = [f"{name} {first:.2f} and {second:.2f} %" for name, first, second in fits]
    return (
        f"Average FIT of both velocities over {len(checked.sweeps)} noise-free sweeps, with glocal "
        f"estimates from {snr(checked.snr_db)} data: {', '.join(parts)}; the paper has "
        f"{printed.FITS[0]} and {printed.FITS[1]} % with its LPV model. What the LPV model loses "
        f"against the non-linear one is the motion that it neglects; what the rigid arm loses is "
        f"the flexibility."
    )


def _about_planning(plan: Planning) -> str:
    """The best experiments, what they gain, and how well predictions held."""
    best, target = plan.candidates[0], plan.targets[0]
    place = f"{np.degrees(best.experiment.theta2):.0f}°"
    own, new = plan.own[0], plan.best[0]
    angles = sorted({round(float(np.degrees(c.experiment.theta2))) for c in plan.chosen})
    places = listed([f"{a}°" for a in angles])
    kinds = sorted({c.experiment.name for c in plan.chosen})
    noise = listed([f"{s:.4f}" for s in plan.noise])
    text = (
        f"For {listed(list(plan.targets))} and white noise of {noise} rad/s, the best "
        f"single experiment is {best.experiment.name} at θ₂ = {place} "
        f"({best.experiment.seconds:g} s): {target} to {100.0 * best.expected[0].std:.3f} %, with "
        f"{plus(100.0 * best.expected[0].bias, 3)} % of bias by the linear model's own error. "
        f"The best {len(plan.chosen)} together ({listed(kinds)}; θ₂ = {places}) give "
        f"{100.0 * new.std:.3f} % ({plus(100.0 * new.bias, 3)} % bias) instead of "
        f"{100.0 * own.std:.3f} % ({plus(100.0 * own.bias, 3)} %) with the study's own. The "
        f"deviation falls with the square root of the length."
    )
    ratios = [p.ratio for p in plan.predicted if np.isfinite(p.found)]
    if ratios:
        text += (
            f" Over the runs the deviations found are {min(ratios):.2f} to {max(ratios):.2f} times "
            f"the predicted ones (mean {float(np.mean(ratios)):.2f})."
        )
    return text


LIKELY = 2.0
"""Root mean squares: a bias within so many is one that a draw of the excitation may well give."""


def _size(both: Compared, EI: float) -> str:
    parts = []
    for table, published in both:
        each = [100.0 * implied_bias(published[k], EI) for k in printed.LOCALS]
        glocal = 100.0 * implied_bias(published[printed.GLOCAL], EI)
        parts.append(
            f"{plus(each[0], 1)} % at π/8, {plus(each[-1], 1)} % at 7π/8 and "
            f"{plus(glocal, 1)} % glocally at {snr(table.snr_db)}"
        )
    table = both[0][0]
    ours = [100.0 * (row.EI[0].mean / EI - 1.0) for row in table.rows]
    product = max(100.0 * (row.EI_of_means / row.EI[0].mean - 1.0) for row in table.rows)
    return (
        f"The paper's means imply an EI that is wrong by {'; by '.join(parts)}. Ours is wrong by "
        f"{plus(min(ours), 2)} to {plus(max(ours), 2)} %. Multiplying means instead of "
        f"averaging products explains {product:.1f} % at most, for ε d⁴ is curved."
    )


def _candidate(both: Compared, sources: Sequence[BiasSource], EI: float) -> Iterator[str]:
    named = {(s.excitation, s.rates): s for s in sources}
    plain, paper = named.get(("prbs", "tip")), named.get(("prbs", "working point"))
    still = named.get(("prbs_balanced", "tip"))
    if plain is None or paper is None or still is None:
        return
    rms = 100.0 * paper.rms
    yield (
        f"What could be so large is the motion: a plain PRBS lets θ₂ wander by "
        f"{paper.wander.mean():.2f} rad on average within an experiment, and (8) takes the "
        f"Jacobian at the working point. Over {len(paper.local)} draws of the excitation, without "
        f"noise, the two together give a bias of {rms[0]:.1f} % rms at the first working point, "
        f"{np.median(rms):.1f} % at the median one, {rms[-1]:.1f} % at the last and "
        f"{100.0 * paper.glocal_rms:.1f} % glocally. With J at the tip's own angles it is "
        f"{100.0 * plain.rms[0]:.1f} % at the first and {100.0 * plain.rms.max():.1f} % at the "
        f"worst point, and with a balanced PRBS, which stays where it is, "
        f"{100.0 * still.rms.max():.2f} % at most."
    )
    yield from (_measured(table, published, paper, EI) for table, published in both)
    yield (
        "The mean of that bias over the draws is "
        f"{_mean(paper.local[:, 0])} % at the first and {_mean(paper.local[:, -1])} % at the last "
        "point (± standard error). An excitation that all runs share gives all of them the same "
        "bias, which no deviation shows. Which excitation and which draw the paper had is not "
        "printed, so this is a possible cause and not a proved one."
    )


def _measured(
    table: EstimateTable, published: Sequence[Numbers], source: BiasSource, EI: float
) -> str:
    """The paper's bias at each point in root mean squares of the source's."""
    each = [implied_bias(published[k], EI) / source.rms[k] for k in printed.LOCALS]
    beyond = [
        f"{table.rows[k].label} ({format_number(abs(x), 2)} rms)"
        for k, x in enumerate(each)
        if abs(x) > LIKELY
    ]
    text = (
        f"At {snr(table.snr_db)} {len(each) - len(beyond)} of {len(each)} of the paper's "
        f"local means lie within {LIKELY:g} rms of that"
    )
    return f"{text}, but not {listed(beyond)}." if beyond else f"{text}."


def _mean(draws: np.ndarray) -> str:
    """'+2.1 ± 2.4' in %."""
    error = 100.0 * float(draws.std(ddof=1)) / np.sqrt(len(draws)) if len(draws) > 1 else 0.0
    return f"{plus(100.0 * float(draws.mean()), 1)} ± {error:.1f}"
