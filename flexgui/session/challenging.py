"""A hidden effect to be found: the data, a guess, and what was true."""

from __future__ import annotations

import json
from abc import ABC
from dataclasses import dataclass, replace
from pathlib import Path

from core.errors import InputError
from core.scenario.read import parse_scenario
from core.study.challenge import truth_in_words
from core.study.seal import opened
from flexgui.jobs import Event, Finished, Task
from flexgui.jobs.tasks.hide import hide
from flexgui.session.effects import present, titled
from flexgui.session.services import Services
from flexgui.session.topics import Topic
from flexgui.session.uploading import Uploading

NONE_GUESSED = "nothing"
SOURCE = "The challenge"


@dataclass(frozen=True)
class Revealed:
    """The end of a challenge."""

    truth: tuple[str, ...]
    """Lines."""
    hidden: tuple[str, ...]
    """Ids of the effects."""
    guessed_right: bool
    tool: str
    """What the tool's own look said, a sentence."""


@dataclass(frozen=True)
class Challenge:
    """What a person was given; the truth stays sealed and never leaves the server before."""

    seed: int
    level: str
    sealed: str
    guess: str = ""
    """Id of an effect, 'nothing', or empty: none yet."""
    size: str = ""
    """As the person wrote it."""
    revealed: Revealed | None = None


class Challenging(Uploading, ABC):
    """At most one challenge, which a new scenario ends."""

    def __init__(self, key: str, folder: Path) -> None:
        super().__init__(key, folder)
        self.challenge: Challenge | None = None
        self.tour: int | None = 0
        """Step of the first visit's tour; None once it was dismissed."""

    def hide(self, seed: int, level: str, services: Services) -> bool:
        """Starts over with recordings of an arm in which something is hidden."""
        task = Task.of(hide, SOURCE, seed=seed, level=level, folder=str(self.folder))

        def told(event: Event) -> None:
            if isinstance(event, Finished):
                self._hidden(seed, level, *event.result)

        return self._submit(services, "hide", task, told)

    def _hidden(self, seed: int, level: str, text: str, sealed: str) -> None:
        run = self.run
        if not self.open(parse_scenario(text, SOURCE)):
            return
        with self._lock:
            self.challenge, self.run = Challenge(seed, level, sealed), run
        self.tell(Topic.CHALLENGE, Topic.RUN)
        self.say(f"Challenge {seed} ({level}): something is hidden in these recordings.")

    def guess(self, kind: str, size: str) -> bool:
        """Commits to an answer; it may be changed until the truth is revealed."""
        known = self.challenge
        if known is None or known.revealed is not None:
            self.say("There is no challenge to guess at; hide an effect first.", bad=True)
            return False
        with self._lock:
            self.challenge = replace(known, guess=kind, size=size.strip()[:80])
        self.tell(Topic.CHALLENGE)
        return True

    def reveal(self) -> bool:
        """Opens the seal, after a guess."""
        known = self.challenge
        if known is None or not known.guess:
            self.say("Guess first: the truth cannot be hidden again.", bad=True)
            return False
        try:
            text = opened(known.sealed, SOURCE)
        except InputError as error:
            self.say(str(error), bad=True)
            return False
        hidden = tuple(json.loads(text)["effects"])
        found = Revealed(
            tuple(truth_in_words(text).splitlines()), hidden, known.guess in hidden, self._tool()
        )
        with self._lock:
            self.challenge = replace(known, revealed=found)
        self.tell(Topic.CHALLENGE)
        return True

    def _tool(self) -> str:
        """What the looks at these recordings said."""
        first = next((look for look in self.looks if look.ranking), None)
        if first is None:
            return "You did not ask the tool what is missing."
        refitted = [r for r in first.ranking if r.refit_drop_percent is not None]
        best = (refitted or list(first.ranking))[0]
        verdict = first.diagnosis.verdict if first.diagnosis is not None else "not finished"
        added = ", ".join(title for _, title in present(self.scenario)) or "nothing"
        words = verdict.replace("_", " ")
        return f"The tool's verdict: {words}; first in its list: {best.title}. Added: {added}."

    def go_on_tour(self, step: int | None) -> None:
        """Shows a step of the tour; None ends it."""
        with self._lock:
            self.tour = step
        self.tell(Topic.TOUR)


def guess_titles(kinds: tuple[str, ...]) -> str:
    """For a sentence."""
    return ", ".join(titled(kinds))
