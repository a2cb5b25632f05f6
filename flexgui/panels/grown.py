"""Effects by hand: add one of the list, or a formula of one's own, and remove one."""

from __future__ import annotations

from core.effects import catalogue
from core.effects.own import states, targets
from core.errors import InputError
from core.workbench import base_model
from flexgui.panels import widgets
from flexgui.panels.candidates import Demonstrate, explanation
from flexgui.panels.page_context import PageContext
from flexgui.panels.words import Words, paragraph
from flexgui.session.effects import present

NOTHING = "nothing added"


class Grown:
    """Controls of the model's effects."""

    def __init__(self, desk: PageContext) -> None:
        self._desk = desk
        session, gui = desk.session, desk.gui
        with gui.add_folder("Add or remove by hand", expand_by_default=False):
            self._by_title = {e.title: kind for kind, e in sorted(catalogue().items())}
            titles = tuple(sorted(self._by_title))
            self._pick = gui.add_dropdown("Effect", titles, disabled=desk.read_only)
            self._about = Words(gui, explanation(self._by_title[titles[0]]))
            self._pick.on_update(lambda _: self._picked())
            self._add = widgets.button(
                desk, "Add this effect", lambda: session.add(self._kind, desk.services)
            )
            self._show = Demonstrate(desk, lambda: self._kind)
            self._present = gui.add_dropdown("In the model", (NOTHING,), disabled=desk.read_only)
            self._remove = widgets.button(desk, "Remove it", self._removed)
        with gui.add_folder("Add an own effect by formula", expand_by_default=False):
            self._own_controls()

    def _own_controls(self) -> None:
        desk, gui = self._desk, self._desk.gui
        arm = base_model(desk.session.scenario).arm
        self._target = gui.add_dropdown("Acts at", tuple(targets(arm)), disabled=desk.read_only)
        self._formula = gui.add_text("Formula", "-a*tanh(dtheta1/0.001)", disabled=desk.read_only)
        self._parameters = gui.add_text("Parameters", "a = 0.5 [N m]", disabled=desk.read_only)
        self._hint = Words(gui)
        self._target.on_update(lambda _: self._show_hint())
        self._own = widgets.button(desk, "Add this formula", self._add_own)
        self._refused = Words(gui)
        self._show_hint()

    @property
    def _kind(self) -> str:
        return self._by_title.get(str(self._pick.value), "")

    def _picked(self) -> None:
        self._about.show(explanation(self._kind))
        self._show.refresh()

    def _show_hint(self) -> None:
        try:
            words = states(base_model(self._desk.session.scenario).arm, str(self._target.value))
        except (InputError, KeyError):
            return
        self._hint.show(
            paragraph(
                f"The torque in N m (at the tip the force in N) from {', '.join(words)} and your "
                f"parameters; with sin, cos, tanh, exp, sqrt, abs, sign. It must vanish with its "
                f"parameters.",
                "soft",
            )
        )

    def _add_own(self) -> None:
        texts = (str(self._target.value), str(self._formula.value), str(self._parameters.value))
        session = self._desk.session
        done = session.add_own(*texts, self._desk.services)
        # The newest message stands on top, which may be out of sight from here.
        self._refused.show("" if done else paragraph(session.message.text, "bad"))

    def _removed(self) -> None:
        session = self._desk.session
        for kind, title in present(session.scenario):
            if title == self._present.value:
                session.remove(kind, self._desk.services)
                return

    def refresh(self, able: bool) -> None:
        """Shows what is in the model."""
        session = self._desk.session
        inside = present(session.scenario)
        titles = tuple(dict.fromkeys(title for _, title in inside)) or (NOTHING,)
        if self._present.options != titles:
            self._present.options = titles
        able = able and not self._desk.read_only
        self._add.disabled = self._own.disabled = not able
        self._remove.disabled = not able or not inside
        self._show.refresh()
