"""The profile likelihood of a parameter, and how the other parameters follow it."""

from __future__ import annotations

import numpy as np

from flexgui.core.results import Profile
from flexgui.sentences.written import shown_unit, with_unit
from flexgui.views import colours
from flexgui.views.layout import Figure, Pane, axis, dots, line, panes

PROFILE_HEIGHT = 420
"""px"""
FOLLOWING = 6
"""Parameters that are drawn: those that change most."""


def profile(found: Profile) -> Figure:
    """Deviance over the parameter with the interval's threshold and, dashed, what the standard
    deviation alone says; below it the change of the others in per cent."""
    e = found.estimate
    unit = shown_unit(found.values, e.unit)
    x = found.values * unit.factor
    hover = f"{e.name} %{{x:.6g}} {unit.name}: %{{y:.3g}}<extra></extra>"
    traces = [
        line(x, found.deviance, "profile", colours.MODEL, hover),
        dots(x, found.deviance, "", colours.MODEL, hover, size=5),
    ]
    if np.isfinite(e.std) and e.std > 0.0:
        fine = np.linspace(found.values[0], found.values[-1], 101)
        square = np.minimum(((fine - e.value) / e.std) ** 2, 1.2 * max(found.deviance.max(), 1.0))
        shown = line(fine * unit.factor, square, "by its std", colours.START, dash="dash")
        traces.insert(0, shown)
    ends = [x[0], x[-1]]
    name = f"{100.0 * found.level:g} %"
    traces.append(line(ends, [found.threshold] * 2, name, colours.FLOOR, dash="dot"))
    label = f"{e.name}{f'@{e.recording}' if e.recording else ''} [{unit.name or '–'}]"
    caption = "Deviance of the best fit with the parameter held there; below it the others."
    rows = [Pane(traces, axis("deviance", rangemode="tozero")), *_others(found, x)]
    return panes(rows, axis(label), caption, PROFILE_HEIGHT, gap=0.08)


def interval_sentence(found: Profile) -> str:
    """'EI1 = 517.5 N m²: 95 % interval 511.1 to 524.0.'"""
    e, factor = found.estimate, shown_unit(found.estimate.value, found.estimate.unit)
    ends = [f"{x * factor.factor:.5g}" if np.isfinite(x) else "no end" for x in found.interval]
    value = with_unit(f"{e.value * factor.factor:.5g}", factor.name)
    return f"{e.label} = {value}: {100.0 * found.level:g} % interval {' to '.join(ends)}."


def _others(found: Profile, x: np.ndarray) -> list[Pane]:
    k = int(np.argmin(np.abs(found.values - found.estimate.value)))
    start = found.paths[k]
    sure = np.flatnonzero(start != 0.0)
    if not sure.size:
        return []
    change = 100.0 * (found.paths[:, sure] / start[sure] - 1.0)
    order = np.argsort(-np.ptp(change, axis=0))[:FOLLOWING]
    lines = [
        line(x, change[:, i], found.others[sure[i]], colours.series(n)) for n, i in enumerate(order)
    ]
    return [Pane(lines, axis("others [%]"), share=0.7)]
