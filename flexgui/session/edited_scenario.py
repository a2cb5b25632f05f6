"""The scenario that is edited, and the live model of the first stage's sliders."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from flexgui.core.arm.build import build_arm
from flexgui.core.errors import InputError
from flexgui.core.scenario.schema import Scenario
from flexgui.library.shipped import demo_scenario
from flexgui.session.scenario_edits import (
    Edit,
    apply_edits,
    cached_model,
    set_simulated_noise,
    simulated_noise,
)
from flexgui.session.scheduling import COMPUTE_TURNS, LatestRequest
from flexgui.session.settings import settings_of
from flexgui.session.state import LiveSettings, PagePart, Topic
from flexgui.stages.arm.live import LiveModel, Prepared, is_new, live_model, prepare

if TYPE_CHECKING:
    from flexgui.session.session import Session

COMPILING = "Another kind of arm: its equations are derived and compiled, which takes seconds."


class EditedScenario:
    """Checks every edit of the scenario, then computes the live model again."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.scenario: Scenario = demo_scenario()
        self.live = LiveSettings()
        self.live_model: LiveModel | None = None
        """The model of the sliders; None before it was computed first."""
        self._worker = LatestRequest(session.faults, PagePart.MODEL)
        self._dragged: set[Topic] = set()
        """What a slider that was dragged has changed and was not notified yet."""

    def change(self, *edits: Edit, dragging: bool = False) -> bool:
        """Edits the scenario; shows a message and changes nothing where the result is invalid.

        While a slider is `dragging`, subscribers are notified only together with a computed arm, so
        that they skip values in between.
        """
        session, models = self._session, self._session.diagnosis.models
        try:
            with session.lock:
                changed = self._as_known(apply_edits(self.scenario, *edits))
                cached_model(changed)
                self.become(changed)
                topics = (Topic.SCENARIO, *models.recall())
                self._dragged |= set(topics) if dragging else set()
        except InputError as error:
            return session.refuse(error)
        if not dragging:
            session.notify(*topics)
        self.refresh()
        session.scenario_changed()
        return True

    def become(self, scenario: Scenario) -> None:
        """Takes another scenario; the slider of the noise shows what its recordings have."""
        self.scenario = scenario
        self.live = replace(self.live, snr_db=simulated_noise(scenario, self.live.snr_db))

    def _as_known(self, scenario: Scenario) -> Scenario:
        """The scenario with the same settings of which something was found: a person who goes back
        to its settings goes back to it. Itself where there is none."""
        settings, checked = settings_of(scenario), self._session.check.checked
        models = (m.version.scenario for m in reversed(self._session.diagnosis.models.all)
                  if m.settings == settings)  # fmt: skip
        if checked is not None and settings_of(checked) == settings:
            return next(models, checked)
        return next(models, scenario)

    def set_live(self, **changes: Any) -> None:
        """Changes slider values that are not part of a scenario."""
        with self._session.lock:
            self.live = replace(self.live, **changes)
        self.refresh()

    def set_noise(self, snr_db: float | None) -> bool:
        """Sets the signal-to-noise ratio `snr_db` in dB of all simulated recordings."""
        if not self.change(set_simulated_noise(snr_db)):
            return False
        self.set_live(snr_db=snr_db)
        return True

    def refresh(self) -> None:
        """Computes the live model again, on another thread."""
        self._worker.request(self._compute)

    def wait_idle(self, timeout: float) -> bool:
        """Whether the live model is up to date within `timeout` s."""
        return self._worker.wait_idle(timeout)

    def close(self) -> None:
        """Computes nothing more."""
        self._worker.close()

    def _compute(self) -> None:
        try:
            base = self._base_model()
            with COMPUTE_TURNS.for_computing():
                with self._session.lock:  # read now: changes while waiting for the lock count
                    scenario, live = self.scenario, self.live
                if scenario is not base.scenario and is_new(build_arm(scenario.arm), base):
                    return  # the change of the arm has made a newer request
                model = live_model(prepare(scenario, base), live)
        except InputError as error:
            self._session.show_message(str(error), bad=True)
            self._session.notify(*self._pending_topics())
            return
        if self._session.message.text == COMPILING:
            self._session.show_message("")
        with self._session.lock:
            self.live_model = model
        # In one call: what is to be kept is written before any of it is shown.
        self._session.notify(Topic.LIVE, *self._pending_topics())

    def _pending_topics(self) -> tuple[Topic, ...]:
        with self._session.lock:
            dragged, self._dragged = self._dragged, set()
        return tuple(dragged)

    def _base_model(self) -> Prepared:
        """A model with the present arm; shows a message where it has to be compiled."""
        with self._session.lock:
            scenario, before = self.scenario, self.live_model
        if before is None:
            return prepare(scenario, before)
        if before.scenario is scenario or not is_new(build_arm(scenario.arm), before):
            return before
        self._session.show_message(COMPILING)
        return prepare(scenario, before)
