"""A folder whose inputs are made anew when what they are about has another shape."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from flexgui.panels.page_context import PageContext


class Rebuilt:
    """Holds inputs and their links to the session."""

    def __init__(self, desk: PageContext, folder: Any) -> None:
        self._desk, self._folder = desk, folder
        self._shape: object = None
        self._syncs: list[Callable[[], None]] = []

    def make(self, shape: object, build: Callable[[], None]) -> None:
        """Calls `build` inside the folder where the shape differs from the last one."""
        if shape == self._shape:
            return
        self._shape = shape
        for sync in self._syncs:
            self._desk.syncs.remove(sync)
        for child in tuple(self._folder._children.values()):
            child.remove()
        before = len(self._desk.syncs)
        with self._folder:
            build()
        self._syncs = self._desk.syncs[before:]
