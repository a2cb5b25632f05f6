"""What follows from the baseline table and from the experiment advice, in words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from core.montecarlo.comparison import GLOCAL, BaselineRow
from core.montecarlo.phrases import signed, snr_words
from core.montecarlo.planning import Planning
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
