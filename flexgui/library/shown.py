"""How results are shown and searched: figures, paragraphs in a notebook, parts by their name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from markupsafe import Markup

from flexgui.core.errors import InputError
from flexgui.core.sentences import did_you_mean
from flexgui.views.layout import plain

if TYPE_CHECKING:
    import plotly.graph_objects as go

T = TypeVar("T")
Views = Mapping[str, Callable[[], Any]]
"""Name -> what draws it; None where there is nothing to show."""


def chosen(views: Views, name: str) -> go.Figure:
    """Draw the view of that name.

    Raises:
        InputError: Where there is no such view, or nothing to show in it.
    """
    figure = looked_up(views, name, f"plot: the view {name!r} is not known")()
    if figure is None:
        raise InputError(f"There is nothing to show in the view {name!r} of this result.")
    return from_dict(plain(figure))


def from_dict(figure: Mapping[str, Any]) -> go.Figure:
    """A figure as plain dictionaries, checked: the page's are made unchecked, for speed."""
    import plotly.graph_objects as go

    return go.Figure(dict(figure), skip_invalid=True)


def looked_up(known: Mapping[str, T], name: str, complaint: str) -> T:
    """The one of that name.

    Raises:
        InputError: Where there is none: the complaint, and the nearest name.
    """
    if name not in known:
        raise InputError(f"{complaint}; {did_you_mean(name, known)}")
    return known[name]


def paragraphs(texts: Iterable[str], style: str = "") -> Markup:
    """As HTML."""
    shown = Markup("<p style='{}'>{}</p>") if style else Markup("<p>{1}</p>")
    return Markup("").join(shown.format(style, text) for text in texts)
