"""The scenario and the live model of its sliders."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from flexgui.core.arm.build import build_arm
from flexgui.core.errors import InputError
from flexgui.core.scenario.schema import Scenario
from flexgui.session.demo import demo_scenario
from flexgui.session.edit import Edit, edited, model_of, noise_of_simulations
from flexgui.session.latest import TURNS, LatestWins
from flexgui.session.state import STAGES, Live, Observable, Part, Topic
from flexgui.stages.arm.live import LiveModel, Prepared, is_new, live_model, prepare

COMPILING = "Another kind of arm: its equations are derived and compiled, which takes seconds."


class Editing(Observable, ABC):
    """What a person changes on the page ends in a checked scenario, and in a model at once."""

    def __init__(self, key: str) -> None:
        super().__init__()
        self.scenario: Scenario = demo_scenario()
        self.live, self.stage = Live(), STAGES[0]
        self.view: LiveModel | None = None
        self._live_worker = LatestWins(self.faults, Part.MODEL)
        self._slid = False
        """Whether the scenario was changed by `slide` and nobody has heard of it."""

    @abstractmethod
    def _scenario_changed(self) -> None:
        """What follows from another scenario besides the live model."""

    @abstractmethod
    def _stage_changed(self) -> None:
        """What follows from another stage being shown."""

    def change(self, *edits: Edit) -> bool:
        """Edits the scenario; where the result is none, says why and changes nothing."""
        if not self._edit(edits):
            return False
        self.notify(Topic.SCENARIO)
        self.refresh_live()
        self._scenario_changed()
        return True

    def slide(self, *edits: Edit) -> bool:
        """As `change`, under a hand that moves on: the subscribers hear of it with the arm that
        was computed for it, and only of the places for which one was."""
        if not self._edit(edits, slid=True):
            return False
        self.refresh_live()
        self._scenario_changed()
        return True

    def _edit(self, edits: Sequence[Edit], slid: bool = False) -> bool:
        try:
            with self._lock:
                changed = edited(self.scenario, *edits)
                model_of(changed)
                self.scenario, self._slid = changed, self._slid or slid
        except InputError as error:
            return self.refuse(error)
        return True

    def set_live(self, **changes: Any) -> None:
        """Moves sliders that belong to no scenario."""
        with self._lock:
            self.live = replace(self.live, **changes)
        self.refresh_live()

    def set_noise(self, snr_db: float | None) -> bool:
        """The same signal-to-noise ratio for all that is simulated."""
        if not self.change(noise_of_simulations(snr_db)):
            return False
        self.set_live(snr_db=snr_db)
        return True

    def refresh_live(self) -> None:
        """Computes the live model anew, soon and on a thread of its own."""
        self._live_worker.ask(self._compute_live)

    def _compute_live(self) -> None:
        try:
            known = self._compiled()
            with TURNS.begin():
                with self._lock:  # only now: what moved while others had their turn counts
                    scenario, live = self.scenario, self.live
                if scenario != known.scenario and is_new(build_arm(scenario.arm), known):
                    return  # whoever changed the arm has asked anew
                view = live_model(prepare(scenario, known), live)
        except InputError as error:
            self.show_message(str(error), bad=True)
            self.notify(*self._unheard())
            return
        if self.message.text == COMPILING:
            self.show_message("")
        with self._lock:
            self.view = view
        # In one call: what is to be kept is written before any of it is shown.
        self.notify(Topic.LIVE, *self._unheard())

    def _unheard(self) -> tuple[Topic, ...]:
        with self._lock:
            slid, self._slid = self._slid, False
        return (Topic.SCENARIO,) if slid else ()

    def _compiled(self) -> Prepared:
        """A model with the arm that is wanted; says so where that may take long."""
        with self._lock:
            scenario, before = self.scenario, self.view
        if before is not None and not is_new(build_arm(scenario.arm), before):
            return before
        if before is not None:
            self.show_message(COMPILING)
        return prepare(scenario, before)

    def show(self, stage: str) -> None:
        """Another stage of the work."""
        if stage in STAGES and stage != self.stage:
            self.stage = stage
            self.notify(Topic.STAGE)
            if self.message.text:
                self.show_message("")
            self._stage_changed()
