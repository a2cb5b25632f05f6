"""What is known of the rig a priori: a diagnosis does not offer what cannot be by it."""

from __future__ import annotations

from typing import Any

from markupsafe import Markup

from flexgui.core.scenario.rig_spec import RigSpec
from flexgui.page.panel import PageContext, PageElement
from flexgui.page.widgets import HtmlBlock, bind, joined
from flexgui.session.scenario_edits import set_value

GEARS = "gear_ratio"
HINT = "Motor turns per joint turn, for each joint: 50, 100."
TICK = Markup(
    "<button type='button' class='tick' role='checkbox' aria-checked='{}' "
    "data-action='known' data-value='{}'{}>{}</button>"
)


class KnownRig(PageElement):
    """A folder with a box to tick for each statement of `[rig]`, and the gears' ratios."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        context.actions.register("known", self._ticked)
        context.syncs.append(self._show)
        with self.gui.add_folder("What do you know about this rig?", expand_by_default=False):
            self._ticks = HtmlBlock(self.gui)
            gears = self.gui.add_text("Gear ratios", self._ratios(), hint=HINT)
            bind(context, gears, self._ratios, self._enter_ratios)
        self._show()

    def _known(self, name: str) -> Any:
        return getattr(self.session.document.scenario.rig, name)

    def _state(self, name: str, value: Any) -> bool:
        return self.session.document.change(set_value(("rig", name), value or None))

    def _show(self) -> None:
        able = Markup(" disabled" if self.context.read_only else "")
        rows = [
            TICK.format(str(self._known(name)).lower(), name, able, words.capitalize())
            for name, words in RigSpec.words().items()
            if name != GEARS
        ]
        self._ticks.show(joined(*rows))

    def _ticked(self, name: str) -> None:
        if name in RigSpec.words() and name != GEARS:
            self._state(name, not self._known(name))

    def _ratios(self) -> str:
        return ", ".join(f"{ratio:g}" for ratio in self._known(GEARS) or ())

    def _enter_ratios(self, text: str) -> bool:
        try:
            return self._state(GEARS, [float(part) for part in text.replace(",", " ").split()])
        except ValueError:
            return False
