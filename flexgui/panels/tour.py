"""The first visit: four steps from a recording to a found effect."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup

from flexgui.panels import widgets
from flexgui.panels.desk import Desk
from flexgui.panels.words import Words
from flexgui.session import Session
from flexgui.session.demo import HIDDEN


@dataclass(frozen=True)
class Step:
    """What stands on the card, and where the person is taken."""

    title: str
    text: str
    stage: str = ""
    """Shown when the step begins; the present one where empty."""
    button: str = ""
    """What the button that leads here says."""
    done: Callable[[Session], bool] = lambda _: True
    """Whether the person has done what the step asks, so that going on is the next thing."""
    found_at: tuple[str, ...] = ()
    """Stages by which a person who walks without the card has come as far as this step."""


STEPS = (
    Step(
        "Find what a model lacks",
        "In four steps: look, compare, diagnose, add. The arm of the tour has an effect that its "
        "model does not know.",
    ),
    Step(
        "1 of 4: look",
        "These recordings were made on the arm; press Play below and watch it bend. On the left: "
        "what was asked of it and what the sensors saw.",
        "Data", "Begin the tour",
    ),
    Step(
        "2 of 4: compare",
        "Fit the model as it is, then see where it fails: press Start identification, and go on "
        "to Compare. The worst places are buttons.",
        "Identify", "Next: compare", lambda s: s.outcome is not None, ("Identify", "Compare"),
    ),
    Step(
        "3 of 4: diagnose",
        "Press Find what is missing. Every known effect is tried on what the model leaves over; "
        "the list says how much each would explain. Open What is it? to read about one.",
        "Diagnose", "Next: diagnose", lambda s: bool(s.looks), ("Diagnose",),
    ),
    Step(
        "4 of 4: add",
        "Press Add beside the first effect. The model is fitted again with it, and the error "
        "falls on the ladder. Undo brings it back. Then try a challenge of your own, below.",
        "Diagnose", "Next: add", lambda s: len(s.looks) > 1,
    ),
)  # fmt: skip


def step_of(tour: int | None, stage: str) -> int | None:
    """The step to show: the card's own, or the one that the person has walked to by the stages."""
    if not tour:
        return tour
    ahead = [k for k, one in enumerate(STEPS) if k > tour and stage in one.found_at]
    return max(ahead, default=tour)


class Tour:
    """A card below the stages; gone once it was dismissed."""

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._card = Words(desk.gui)
        self._go: Any = widgets.button(desk, "Next", self._next, prominent=True)
        self._end: Any = widgets.button(desk, "No tour, thank you", self._dismiss)

    def _next(self) -> None:
        session = self._desk.session
        step = step_of(session.tour, session.stage)
        if step is None or step + 1 >= len(STEPS):
            session.go_on_tour(None)
            return
        if step == 0 and not session.choose(HIDDEN, self._desk.services):
            return
        session.go_on_tour(step + 1)
        session.show(STEPS[step + 1].stage)

    def _dismiss(self) -> None:
        self._desk.session.go_on_tour(None)

    def refresh(self) -> None:
        """Shows the step."""
        step = step_of(self._desk.session.tour, self._desk.session.stage)
        shown = step is not None and not self._desk.read_only
        self._go.visible = self._end.visible = shown
        if step is None or not shown:
            self._card.show("")
            return
        one = STEPS[step]
        card = Markup("<div class='tour'><p class='lead'>{}</p><p>{}</p></div>")
        self._card.show(card.format(one.title, one.text))
        self._go.color = "blue" if one.done(self._desk.session) else "gray"
        last = step + 1 >= len(STEPS)
        self._go.label = "End the tour" if last else STEPS[step + 1].button
        self._end.visible = not last
        self._end.label = "No tour, thank you" if step == 0 else "Leave the tour"
