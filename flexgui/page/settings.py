"""How the page looks in one browser, which keeps it: colours, size of text, detail of the arm."""

from __future__ import annotations

from markupsafe import Markup

from flexgui.page.actions import selection
from flexgui.page.layout import THEMES
from flexgui.page.panel import PageContext

MENU = Markup(
    "<details class='settings'><summary title='Settings'>Settings</summary><div>{}</div></details>"
)
KEPT = {
    "text": ("Text size", {"100": "usual", "115": "larger", "130": "largest"}),
    "look": ("3-D view", {"auto": "automatic", "fine": "with shadows", "plain": "plain, faster"}),
}
"""What the browser alone knows: `browser/page.js` stores it and puts it into effect."""


def settings_menu(context: PageContext) -> Markup:
    """A menu that unfolds."""
    themes = {name: name for name in THEMES}
    rows = [selection("Colours", "theme", themes, context.theme.chosen)]
    for name, (label, options) in KEPT.items():
        rows.append(selection(label, f"keep {name}", options, ""))
    return MENU.format(Markup("").join(rows))
