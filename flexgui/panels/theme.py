"""Light or dark: as the system is, or as a person has chosen, which their browser keeps."""

from __future__ import annotations

from collections.abc import Callable

import viser

from flexgui.panels.page_layout import THEME_KEPT_AS, Widths, Window

AS_SYSTEM, LIGHT, DARK = "as the system", "light", "dark"
THEMES = (AS_SYSTEM, LIGHT, DARK)


class Theme:
    """Of one browser's page."""

    def __init__(self, client: viser.ClientHandle) -> None:
        self._client = client
        self.chosen, self.dark = AS_SYSTEM, False
        self._system_dark = False
        self.followers: list[Callable[[bool], None]] = []
        """Called with whether the page is dark, when that changes."""

    def fit(self, window: Window, shares: Widths) -> None:
        """As the browser says: how its system is, and what was chosen in it before."""
        self._system_dark = window.system_dark
        if window.theme in (LIGHT, DARK):
            self.chosen = window.theme
        self._apply()

    def choose(self, name: str) -> None:
        """One of `THEMES`; the browser keeps it."""
        self.chosen = name if name in THEMES else AS_SYSTEM
        self._client.local_storage.set_item(THEME_KEPT_AS, self.chosen)
        self._apply()

    def _apply(self) -> None:
        dark = self._system_dark if self.chosen == AS_SYSTEM else self.chosen == DARK
        if dark == self.dark:
            return
        self.dark = dark
        self._client.gui.configure_theme(dark_mode=dark, show_share_button=False, show_logo=False)
        for tell in self.followers:
            tell(dark)
