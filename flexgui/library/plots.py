"""Figures of results: the same pure view functions as on the page and in the report."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from flexgui.core.errors import InputError
from flexgui.core.sentences import did_you_mean
from flexgui.views.layout import plain

if TYPE_CHECKING:
    import plotly.graph_objects as go

Views = Mapping[str, Callable[[], Any]]
"""Name -> what draws it; None where there is nothing to show."""


def chosen(views: Views, name: str) -> go.Figure:
    """Draw the view of that name.

    Raises:
        InputError: Where there is no such view, or nothing to show in it.
    """
    if name not in views:
        raise InputError(f"plot: the view {name!r} is not known; {did_you_mean(name, views)}")
    figure = views[name]()
    if figure is None:
        raise InputError(f"There is nothing to show in the view {name!r} of this result.")
    return from_dict(plain(figure))


def from_dict(figure: Mapping[str, Any]) -> go.Figure:
    """A figure as plain dictionaries, checked: the page's are made unchecked, for speed."""
    import plotly.graph_objects as go

    return go.Figure(dict(figure), skip_invalid=True)
