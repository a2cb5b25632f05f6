"""What the rest of an error depends on, and the laws that are proposed for it."""

from __future__ import annotations

import numpy as np

from flexgui.core.results import Carrier, LawTerm, Proposal, ProposedLaw
from flexgui.sentences.figures import short_percent
from flexgui.sentences.proposal import carrier_words
from flexgui.sentences.written import format_number, shown_unit, size_text
from flexgui.views import colours
from flexgui.views.layout import Figure, axis, dots, figure, line, named_axis
from flexgui.views.table import Row, Table, numbers, texts

VARIABLE_ROW, AROUND_ROWS = 30, 80
"""px: of one variable, and of the axis."""

MOST_SHOWN = 5
"""Variables that are compared."""


def carrier_shares(proposal: Proposal | None) -> Figure | None:
    """A bar per variable: what a smooth function of it explains; None without any."""
    if proposal is None or not proposal.carriers:
        return None
    shown = proposal.carriers[:MOST_SHOWN]
    names = [f"{carrier_words(c)}, at {c.target_title}" for c in shown]
    shares = [100.0 * max(c.share, 0.0) for c in shown]
    text = (
        "Part of the squared error above the noise that a smooth function of one variable explains "
        "on parts of the recordings that it was not fitted to."
    )
    bars = {
        "type": "bar", "orientation": "h", "x": shares, "y": list(range(len(shown))),
        "marker": {"color": colours.ADDED}, "text": [f"{x:.0f} %" for x in shares],
        "textposition": "auto", "hoverinfo": "skip", "showlegend": False,
    }  # fmt: skip
    rows = named_axis(names, range=[len(shown) - 0.5, -0.5], automargin=True, ticks="")
    x_axis = axis("explained [%]", range=[0, 100])
    return figure([bars], x_axis, rows, text, AROUND_ROWS + VARIABLE_ROW * len(shown))


def law_over_variable(carrier: Carrier, term: LawTerm | None = None) -> Figure:
    """A smooth function, or the term of a law and what the model with it shows in its place, with
    two standard deviations either way."""
    unit = shown_unit(carrier.values, carrier.value_unit)
    place = shown_unit(carrier.places, carrier.unit)
    hover = f"%{{x:.4g}} {place.name}, %{{y:.4g}} {unit.name}<extra></extra>"
    every = np.stack([carrier.places, carrier.values, 2.0 * carrier.deviations])
    seen = every[:, np.isfinite(carrier.deviations)]
    x, y, wide = seen[:, seen[2] < np.ptp(seen[1])]
    name = "what the rest shows" if term is None else "what the recordings show"
    bars = {"type": "data", "array": wide * unit.factor, "thickness": 1, "width": 0}
    shown = dots(x * place.factor, y * unit.factor, name, colours.RESIDUAL, hover)
    traces = [shown | {"error_y": bars}]
    if term is not None:
        places, values = term.places * place.factor, term.values * unit.factor
        traces.append(line(places, values, "the law", colours.ADDED, hover, width=2.6))
    what = "function" if carrier.factor else "missing"
    title = carrier.title[0].upper() + carrier.title[1:]
    return figure(traces, axis(place.label(title)), axis(unit.label(what)), _caption(carrier))


def _caption(carrier: Carrier) -> str:
    where = f"At {carrier.target_title}, over {carrier_words(carrier)}"
    return f"{where}; bars are two standard deviations either way."


def _values(law: ProposedLaw) -> str:
    return "; ".join(size_text(e.name, e) for e in law.parameters)


def laws_table(proposal: Proposal | None) -> Table | None:
    """A row per law: formula, values, what it explains, errors; None without any."""
    if proposal is None or not proposal.laws:
        return None
    rows = tuple(
        Row(
            (
                law.title, law.formula, _values(law),
                short_percent(100.0 * law.explained), format_number(law.rms[1], 3),
                format_number(law.unseen_rms[1], 3),
            )
        )
        for law in proposal.laws
    )  # fmt: skip
    columns = (*texts("Law", "Formula", "Values"), *numbers("Explains", "Error", "Unseen"))
    return Table(columns, rows, "Errors in multiples of the noise floor.")
