"""Effects that could be missing, best explanation first."""

from __future__ import annotations

from collections.abc import Sequence

from markupsafe import Markup

from flexgui.core.results import RankedEffect
from flexgui.sentences.ranked import ORDER, nesting, tie, worth_listing
from flexgui.sentences.written import format_number, size_text
from flexgui.views import colours
from flexgui.views.layout import Figure, axis, figure
from flexgui.views.names import equation, plain_symbol
from flexgui.views.table import Row, Table, numbers, texts

PALE = colours.faded(colours.ADDED, 0.5)
"""Of effects that were not added."""

SHOWN = 10
"""Bars in the figure; those below explain next to nothing as a rule."""

LEAST_SEEN = 0.5
"""%: a shorter bar is one or two pixels wide, and a figure of such bars looks empty."""

RANKING_COLUMNS = (
    *texts("Effect"),
    *numbers("Explains, refitted [%]", "Estimate before refitting [%]"),
    *numbers("Evidence ΔBIC", "Chance of noise"),
    *texts("Relation to others", "Size when refitted"),
)


def _is_seen(ranked: RankedEffect) -> bool:
    drops = (ranked.expected_drop_percent, ranked.refit_drop_percent)
    return any(drop is not None and drop >= LEAST_SEEN for drop in drops)


def ranking(ranked: Sequence[RankedEffect], accepted: str | None = None) -> Figure | None:
    """Two bars per effect: estimate before refitting and share after it; None if all are zero."""
    shown = worth_listing(ranked)[:SHOWN]
    if not any(_is_seen(r) for r in shown):
        return None
    bar = {"type": "bar", "orientation": "h", "y": [r.title for r in shown]}
    bar_colours = [colours.ADDED if accepted in (None, r.effect) else PALE for r in shown]
    expected = bar | {
        "name": "estimate before refitting", "x": [r.expected_drop_percent for r in shown],
        "marker": {"color": colours.faded(colours.START, 0.45)},
        "hovertemplate": "%{y}: %{x:.1f} % before refitting<extra></extra>",
    }  # fmt: skip
    refitted = bar | {
        "name": "after refitting", "x": [r.refit_drop_percent for r in shown],
        "marker": {"color": bar_colours},
        "hovertemplate": "%{y}: %{x:.2f} % after refitting<extra></extra>",
    }  # fmt: skip
    text = (
        "Share of the squared error above the noise floor. Pale: linear estimate before "
        "refitting. Full: after refitting the effect and all other parameters; only the best few "
        "are refitted."
    )
    drawn = figure(
        [expected, refitted], axis("error explained [%]", range=[0, 103]),
        axis(autorange="reversed", automargin=True, type="category"), text, 150 + 34 * len(shown),
        barmode="group", bargap=0.3,
    )  # fmt: skip
    # From the edge of the figure: the names of effects take much of its width.
    drawn["layout"]["legend"] |= {"xref": "container"}
    return drawn


def ranking_table(ranked: Sequence[RankedEffect], accepted: str | None = None) -> Table:
    """The candidates that explain something, with their figures."""
    titles = {r.effect: r.title for r in ranked}
    best = accepted or (ranked[0].effect if ranked else "")
    shown = worth_listing(ranked)
    rows = tuple(_row(r, titles, accepted, best) for r in shown)
    text = (
        "Explains: share of the squared error above the noise floor. ΔBIC: gain in evidence with "
        f"a penalty for each parameter; above 10 is very strong. Chance of noise: probability of "
        f"noise alone, corrected for all trials. {ORDER}"
    )
    if len(shown) < len(ranked):
        text += f" Not listed, as they explain nothing: {len(ranked) - len(shown)}."
    return Table(RANKING_COLUMNS, rows, text)


def _row(ranked: RankedEffect, titles: dict[str, str], accepted: str | None, best: str) -> Row:
    cells = (
        ranked.title,
        _share(ranked.refit_drop_percent),
        _share(ranked.expected_drop_percent),
        "" if ranked.delta_bic is None else format_number(ranked.delta_bic, 3),
        chance(ranked.p_value),
        _beside(ranked, titles, best),
        typeset_sizes(ranked),
    )
    return Row(cells, strong=ranked.effect == accepted)


def _beside(ranked: RankedEffect, titles: dict[str, str], best: str) -> str:
    """What it cannot be distinguished from, and its relation to the best effect."""
    others = ", ".join(titles.get(kind, kind) for kind in ranked.confused_with)
    parts = (
        f"cannot be distinguished from {others}" if others else "",
        tie(ranked),
        nesting(ranked.effect, best),
    )
    return "; ".join(p for p in parts if p)


def sizes(ranked: RankedEffect) -> str:
    """'f_c1 = 1.201 ± 0.001 N m, ...' for plain text."""
    return ", ".join(size_text(plain_symbol(e.symbol, e.name), e) for e in ranked.parameters)


def typeset_sizes(ranked: RankedEffect) -> Markup:
    """The same with subscripts, for HTML."""
    return Markup(", ").join(equation(e) for e in ranked.parameters)


def _share(percent: float | None) -> str:
    """Per cent with at most two decimals; never 100."""
    if percent is None:
        return ""
    return "> 99.9" if percent > 99.9 else format_number(percent, 3, keep_zeros=True)


def chance(p_value: float) -> str:
    """'< 10⁻⁹', '0.02' of a probability `p_value`."""
    return "< 10⁻⁹" if p_value < 1e-9 else format_number(p_value, 2)
