"""The scenario, and the model of the first stage's sliders that follows each change of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from flexgui.core.arm.build import build_arm
from flexgui.core.errors import InputError
from flexgui.core.scenario.schema import Scenario
from flexgui.library.shipped import demo_scenario
from flexgui.session.edit import Edit, edited, model_of, noise_of_simulations
from flexgui.session.latest import TURNS, LatestWins
from flexgui.session.state import Live, Part, Topic
from flexgui.stages.arm.live import LiveModel, Prepared, is_new, live_model, prepare

if TYPE_CHECKING:
    from flexgui.session.session import Session

COMPILING = "Another kind of arm: its equations are derived and compiled, which takes seconds."


class Document:
    """What a person changes on the page ends in a checked scenario, and in a model at once."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.scenario: Scenario = demo_scenario()
        self.live = Live()
        self.view: LiveModel | None = None
        """The model of the sliders; None before it was computed."""
        self._worker = LatestWins(session.faults, Part.MODEL)
        self._slid = False
        """Whether the scenario was changed by `slide` and nobody has heard of it."""

    def change(self, *edits: Edit) -> bool:
        """Edits the scenario; where the result is none, says why and changes nothing."""
        if not self._edit(edits):
            return False
        self._session.notify(Topic.SCENARIO)
        self.refresh()
        self._session.scenario_changed()
        return True

    def slide(self, *edits: Edit) -> bool:
        """As `change`, under a hand that moves on: the subscribers hear of it with the arm that
        was computed for it, and only of the places for which one was."""
        if not self._edit(edits, slid=True):
            return False
        self.refresh()
        self._session.scenario_changed()
        return True

    def _edit(self, edits: Sequence[Edit], slid: bool = False) -> bool:
        try:
            with self._session.lock:
                changed = edited(self.scenario, *edits)
                model_of(changed)
                self.scenario, self._slid = changed, self._slid or slid
        except InputError as error:
            return self._session.refuse(error)
        return True

    def set_live(self, **changes: Any) -> None:
        """Moves sliders that belong to no scenario."""
        with self._session.lock:
            self.live = replace(self.live, **changes)
        self.refresh()

    def set_noise(self, snr_db: float | None) -> bool:
        """The same signal-to-noise ratio for all that is simulated."""
        if not self.change(noise_of_simulations(snr_db)):
            return False
        self.set_live(snr_db=snr_db)
        return True

    def refresh(self) -> None:
        """Computes the model of the sliders anew, soon and on a thread of its own."""
        self._worker.ask(self._compute)

    def wait_idle(self, timeout: float) -> bool:
        """Whether the model is that of the sliders within `timeout` s."""
        return self._worker.wait_idle(timeout)

    def close(self) -> None:
        """Computes nothing more."""
        self._worker.close()

    def _compute(self) -> None:
        try:
            known = self._compiled()
            with TURNS.begin():
                with self._session.lock:  # only now: what moved while others had their turn counts
                    scenario, live = self.scenario, self.live
                if scenario is not known.scenario and is_new(build_arm(scenario.arm), known):
                    return  # whoever changed the arm has asked anew
                view = live_model(prepare(scenario, known), live)
        except InputError as error:
            self._session.show_message(str(error), bad=True)
            self._session.notify(*self._unheard())
            return
        if self._session.message.text == COMPILING:
            self._session.show_message("")
        with self._session.lock:
            self.view = view
        # In one call: what is to be kept is written before any of it is shown.
        self._session.notify(Topic.LIVE, *self._unheard())

    def _unheard(self) -> tuple[Topic, ...]:
        with self._session.lock:
            slid, self._slid = self._slid, False
        return (Topic.SCENARIO,) if slid else ()

    def _compiled(self) -> Prepared:
        """A model with the arm that is wanted; says so where that may take long."""
        with self._session.lock:
            scenario, before = self.scenario, self.view
        if before is None:
            return prepare(scenario, before)
        if before.scenario is scenario or not is_new(build_arm(scenario.arm), before):
            return before
        self._session.show_message(COMPILING)
        return prepare(scenario, before)
