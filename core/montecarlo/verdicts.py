"""The sentences of a study: how the methods compare, what advice is worth, where a bias comes
from.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from core.montecarlo import printed
from core.montecarlo.comparison import GLOCAL, BaselineRow, BiasSource
from core.montecarlo.estimates import EstimateTable, comparable, implied_bias
from core.montecarlo.planning import Planning
from core.montecarlo.printed import Numbers
from core.sentences import listed
from core.written import format_number

KINDS = {
    "identified": "at identified working points",
    "unseen": "at unseen working points",
    "sweeps": "on sweeps",
}
NONLINEAR = "non-linear output error"

Cells = dict[tuple[int, float | None], dict[str, BaselineRow]]
"""(points, ratio) -> method -> row"""

TIE = 0.05
"""% of FIT"""


def about_baselines(rows: Sequence[BaselineRow]) -> Iterator[tuple[str, str]]:
    """How often each method is best, and by how much glocal is ahead or behind."""
    if not rows:
        return
    cells: Cells = {}
    for row in rows:
        cells.setdefault((row.points, row.snr_db), {})[row.method] = row
    sentences = [_wins(cells, kind, words) for kind, words in KINDS.items()]
    linear = {
        key: {name: row for name, row in methods.items() if name != NONLINEAR}
        for key, methods in cells.items()
    }
    sentences.append(_wins(linear, "sweeps", "on sweeps among the linear models"))
    others = [m for m in next(iter(cells.values())) if m != GLOCAL]
    sentences += [_against(cells, name) for name in others]
    yield "Does glocal hold what is claimed for it?", " ".join(sentences)


def _wins(cells: Cells, kind: str, words: str) -> str:
    best, lost = 0, []
    for (points, snr), methods in cells.items():
        top = max(methods.values(), key=lambda r: r.fit[kind])
        if methods[GLOCAL].fit[kind] >= top.fit[kind] - TIE:
            best += 1
        else:
            lost.append(f"{points} points and {snr_words(snr)}: {top.method}")
    text = (
        f"In FIT {words} glocal is best, or within {TIE:g} points of the best, in {best} of "
        f"{len(cells)} cells"
    )
    names = sorted({each.split(": ")[1] for each in lost})
    return f"{text}; beaten by {listed(names)} in {len(lost)}." if lost else f"{text}."


def _against(cells: Cells, name: str) -> str:
    pairs = [(methods[name], methods[GLOCAL]) for methods in cells.values() if name in methods]
    gain = [g.fit["sweeps"] - m.fit["sweeps"] for m, g in pairs]
    poles = [m.pole_error / max(g.pole_error, 1e-300) for m, g in pairs]
    time = [m.seconds / g.seconds for m, g in pairs]
    return (
        f"Against {name}: glocal is {signed(float(np.median(gain)), 2)} points of FIT on sweeps "
        f"({signed(min(gain), 2)} to {signed(max(gain), 2)}), its poles are "
        f"{format_number(float(np.median(poles)), 2)} times as near, and the other takes "
        f"{format_number(float(np.median(time)), 2)} times as long (medians)."
    )


def about_planning(plan: Planning | None) -> Iterator[tuple[str, str]]:
    """The best experiments, what they gain, and how well predictions held."""
    if plan is None or not plan.chosen:
        return
    best, target = plan.candidates[0], plan.targets[0]
    place = f"{np.degrees(best.experiment.theta2):.0f}°"
    own, new = plan.own[0], plan.best[0]
    angles = sorted({round(float(np.degrees(c.experiment.theta2))) for c in plan.chosen})
    places = listed([f"{a}°" for a in angles])
    kinds = sorted({c.experiment.name for c in plan.chosen})
    text = (
        f"For {listed(list(plan.targets))} and white noise of {_noise(plan)} rad/s, the best "
        f"single experiment is {best.experiment.name} at θ₂ = {place} "
        f"({best.experiment.seconds:g} s): {target} to {100.0 * best.expected[0].std:.3f} %, with "
        f"{signed(100.0 * best.expected[0].bias, 3)} % of bias by the linear model's own error. "
        f"The best {len(plan.chosen)} together ({listed(kinds)}; θ₂ = {places}) give "
        f"{100.0 * new.std:.3f} % ({signed(100.0 * new.bias, 3)} % bias) instead of "
        f"{100.0 * own.std:.3f} % ({signed(100.0 * own.bias, 3)} %) with the study's own. The "
        f"deviation falls with the square root of the length."
    )
    ratios = [p.ratio for p in plan.predicted if np.isfinite(p.found)]
    if ratios:
        text += (
            f" Over the runs the deviations found are {min(ratios):.2f} to {max(ratios):.2f} times "
            f"the predicted ones (mean {float(np.mean(ratios)):.2f})."
        )
    yield "Which experiments to make", text


def _noise(plan: Planning) -> str:
    return listed([f"{s:.4f}" for s in plan.noise])


LIKELY = 2.0
"""Root mean squares: a bias within so many is one that a draw of the excitation may well give."""

Compared = tuple[EstimateTable, tuple[Numbers, ...]]


def about_bias(
    tables: Sequence[EstimateTable], sources: Sequence[BiasSource], EI: float
) -> Iterator[tuple[str, str]]:
    """Nothing where no table can be laid beside the paper's."""
    both = [(t, published) for t in tables if (published := comparable(t)) is not None]
    if both:
        sentences = [_size(both, EI), *_candidate(both, sources, EI)]
        yield "The bias in EI that the paper's means imply", " ".join(sentences)


def _size(both: Sequence[Compared], EI: float) -> str:
    parts = []
    for table, published in both:
        each = [100.0 * implied_bias(published[k], EI) for k in printed.LOCALS]
        glocal = 100.0 * implied_bias(published[printed.GLOCAL], EI)
        parts.append(
            f"{signed(each[0], 1)} % at π/8, {signed(each[-1], 1)} % at 7π/8 and "
            f"{signed(glocal, 1)} % glocally at {snr_words(table.snr_db)}"
        )
    table = both[0][0]
    ours = [100.0 * (row.EI[0].mean / EI - 1.0) for row in table.rows]
    product = max(100.0 * (row.EI_of_means / row.EI[0].mean - 1.0) for row in table.rows)
    return (
        f"The paper's means imply an EI that is wrong by {'; by '.join(parts)}. Ours is wrong by "
        f"{signed(min(ours), 2)} to {signed(max(ours), 2)} %. Multiplying means instead of "
        f"averaging products explains {product:.1f} % at most, for ε d⁴ is curved."
    )


def _candidate(both: Sequence[Compared], sources: Sequence[BiasSource], EI: float) -> Iterator[str]:
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
        f"At {snr_words(table.snr_db)} {len(each) - len(beyond)} of {len(each)} of the paper's "
        f"local means lie within {LIKELY:g} rms of that"
    )
    return f"{text}, but not {listed(beyond)}." if beyond else f"{text}."


def _mean(draws: np.ndarray) -> str:
    """'+2.1 ± 2.4' in %."""
    error = 100.0 * float(draws.std(ddof=1)) / np.sqrt(len(draws)) if len(draws) > 1 else 0.0
    return f"{signed(100.0 * float(draws.mean()), 1)} ± {error:.1f}"


def snr_words(snr_db: float | None) -> str:
    """'SNR ∞' or '20 dB'."""
    return "SNR ∞" if snr_db is None else f"{snr_db:g} dB"


def signed(value: float, digits: int) -> str:
    """'+0.03', with a true minus, and no sign before a zero."""
    text = f"{value:+.{digits}f}"
    return text[1:] if float(text) == 0.0 else text.replace("-", "−")
