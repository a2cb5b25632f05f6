"""The tour: which card it shows, from the work done so far and the stage that is shown."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from flexgui.core.results import NOTHING, UNJUDGED
from flexgui.core.sentences import first_sentence
from flexgui.library.shipped import is_of_tour
from flexgui.sentences.verdict import is_explained, verdict_paragraphs
from flexgui.session.state import Topic
from flexgui.stages.diagnose.model_versions import ModelVersion, error_stayed, last_change

if TYPE_CHECKING:
    from flexgui.session.session import Session

NO_MORE = "Nothing else is missing that these recordings could show."
OFFERED, STARTED = 0, 1
"""Values of a session's `tour`; None: dismissed."""

FIRST_STAGE = "Arm"
"""The stage where the tour is offered: on later stages the person works without it."""


class Tour:
    """The state of the tour: offered, started or dismissed."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.step: int | None = OFFERED
        """None where it was dismissed."""

    def set_step(self, step: int | None) -> None:
        """Sets OFFERED or STARTED; None dismisses the tour."""
        with self._session.changing(Topic.TOUR):
            self.step = step


@dataclass(frozen=True)
class Card:
    """Title and text; the text names a button of the stage, else the card has its own `button`."""

    title: str
    text: str
    button: str = ""


LOOK, COMPARE, DIAGNOSE, ADD = (
    f"{k} of 4: {name}" for k, name in enumerate(("look", "compare", "diagnose", "add"), start=1)
)
DONE = "Done"
BEGIN, END = "Begin the tour", "End the tour"

SEARCH_TEXT = (
    "Every known effect is tried on the residual. The list shows the share of the error that each "
    "explains. Open What is it? to read more."
)
OFFER = Card(
    "Find the physics your model lacks.",
    "The tour: an arm with one hidden effect. Look, compare, diagnose, add. Or use your own "
    "recordings: CSV, Parquet or MAT files.",
    BEGIN,
)
AT_ARM = Card(LOOK, "This is the arm. Press Next: take measurements to see what was recorded.")
_DATA_TEXT = (
    "These recordings contain an effect that the model lacks. {} The plots show references and "
    "measurements. Then press Next: identify to fit the model."
)
AT_DATA = Card(LOOK, _DATA_TEXT.format("Press Play below the arm and watch it bend."))
BEFORE_PLAY = Card(
    LOOK, _DATA_TEXT.format("The first one is being prepared; then Play appears below the arm.")
)
TO_FIT = Card(
    COMPARE,
    "Press Start identification: it fits the model's parameters. Then you can see where the model "
    "fails.",
)
FITTING = Card(
    COMPARE, "The model's parameters are fitted. Then you can see where the model fails."
)
FITTED = Card(
    COMPARE,
    "The model is fitted. Press Next: compare model and measurements to see where it fails.",
)
UNFITTED = Card(COMPARE, "The model is not fitted yet. Press Identify first.")
AT_COMPARE = Card(
    COMPARE,
    "Press one of the worst places: plots, time-line and arm jump to it. Then press Next: "
    "diagnose to try every known effect on the residual.",
)
TO_FIND = Card(DIAGNOSE, f"Press Find what is missing. {SEARCH_TEXT}")
SEARCHING = Card(DIAGNOSE, SEARCH_TEXT)


def card(session: Session) -> Card | None:
    """The card to show; None if there is none."""
    if session.tour.step == OFFERED:
        return OFFER if session.stage == FIRST_STAGE else None
    if not is_on_tour(session):
        return None
    shown = CARD_OF_STAGE.get(session.stage, _elsewhere)(session)
    # Once all is found, no card asks for an earlier step.
    is_over = _diagnose(session).title == DONE
    return None if is_over and shown.title != DONE else shown


def is_on_tour(session: Session) -> bool:
    """Whether the tour has started on its own scenario."""
    return session.tour.step == STARTED and is_of_tour(session.document.scenario)


def needs_fit(session: Session) -> bool:
    """Whether the model has no fit at its present settings and no job runs."""
    return session.identification.current is None and not session.run.busy


def needs_search(session: Session) -> bool:
    """Whether the present model was not diagnosed yet and no job runs."""
    scenario, versions = session.document.scenario, session.diagnosis.versions
    return not (session.run.busy or any(version.scenario == scenario for version in versions))


def card_has_button(session: Session) -> bool:
    """Whether the card's own button is the next to press, so that no other one is highlighted."""
    shown = card(session)
    return shown is not None and bool(shown.button)


def next_stage(session: Session) -> str:
    """The stage where the tour continues."""
    if session.diagnosis.shown_versions:
        return "Diagnose"
    return "Identify" if session.identification.outcome is None else "Compare"


def _data(session: Session) -> Card:
    return BEFORE_PLAY if session.playback.motion is None else AT_DATA


def _identify(session: Session) -> Card:
    if session.run.state.busy and session.run.state.kind == "identify":
        return FITTING
    return TO_FIT if session.identification.current is None else FITTED


def _compare(session: Session) -> Card:
    version, now = session.diagnosis.newest, session.document.scenario
    found = None if version is None or version.scenario != now else version.diagnosis
    if found is not None and is_explained(found):
        return Card(DONE, "The residual is only noise now.")
    return AT_COMPARE if session.comparison.shown else UNFITTED


def _diagnose(session: Session) -> Card:
    version, pending = session.diagnosis.newest, session.diagnosis.pending
    if session.diagnosis.to_add:
        return Card(ADD, _fitted_with(session.diagnosis.to_add))
    if pending is not None:
        return _adding(session, pending) if pending.added else _looking(pending)
    if version is None or version.scenario != session.document.scenario or not version.ranking:
        return TO_FIND
    if version.added and len(session.diagnosis.versions) > 1:
        return _added(session, version)
    found = version.diagnosis
    if found is not None and found.verdict in (NOTHING, UNJUDGED) and not found.unfinished:
        return Card(DONE, first_sentence(verdict_paragraphs(found)[0]), END)
    return Card(
        ADD,
        "What is it? explains an effect, and Show what it does in it. Press Add beside "
        f"{version.ranking[0].title}: the model is fitted again with it, and the error falls on "
        "the ladder if that is what was missing. Undo the last step restores the previous model.",
    )


def _looking(pending: ModelVersion) -> Card:
    """While effects are tried: the first of the list can be added before the end."""
    if not pending.ranking:
        return SEARCHING
    return Card(
        DIAGNOSE,
        "The list is in the order of what each effect explains so far; the line through the "
        "residual is what the first one predicts. Wait until every effect was tried, or press Add "
        "beside one of them.",
    )


def _fitted_with(title: str) -> str:
    return (
        f"The model is fitted with {title}. If that is what was missing, its error falls on the "
        "ladder."
    )


def _adding(session: Session, pending: ModelVersion) -> Card:
    change = last_change(session.diagnosis.shown_versions) if pending.found is not None else None
    if change is None:
        return Card(ADD, _fitted_with(pending.title))
    went = "fell" if change.fell else "went"
    return Card(
        ADD,
        f"With {pending.title} the error {went} {change.words}. Now the known effects are tried on "
        "the residual.",
    )


def _added(session: Session, version: ModelVersion) -> Card:
    change = last_change(session.diagnosis.versions)
    words = "" if change is None else change.words
    if error_stayed(session.diagnosis.versions):
        return Card(
            ADD,
            f"The error did not fall: it went {words}. {version.title} was not the cause. Press "
            "Undo the last step and try another.",
        )
    verdict = None if version.diagnosis is None else version.diagnosis.verdict
    if version.diagnosis is not None and verdict in (NOTHING, UNJUDGED):
        rest = NO_MORE if is_explained(version.diagnosis) else "No other missing effect was found."
        return Card(
            DONE,
            f"The error fell {words}: {version.title} was missing. {rest} Undo it and try another, "
            "or take a challenge.",
            END,
        )
    if verdict is None:
        on = "Press Find what is missing to examine the residual"
    else:
        on = f"Something is still missing: press Add beside {version.ranking[0].title}"
    return Card(
        ADD,
        f"With {version.title} the error fell {words}. {on}, or Undo the last step and try "
        "another.",
    )


def _elsewhere(session: Session) -> Card:
    """At a stage without a card of its own."""
    shown, stage = _diagnose(session), next_stage(session)
    title = shown.title if stage == "Diagnose" and not shown.button else COMPARE
    return Card(title, f"The tour continues at {stage}, in the row of stages above.")


CARD_OF_STAGE: dict[str, Callable[[Session], Card]] = {
    "Arm": lambda _: AT_ARM,
    "Data": _data,
    "Identify": _identify,
    "Compare": _compare,
    "Diagnose": _diagnose,
}
"""Stage -> function that makes its card."""
