"""A hidden effect to be found: the data, a guess, and what was true."""

from __future__ import annotations

import json
import time
from abc import ABC
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

from flexgui.classroom.board import Entry, plain_name
from flexgui.classroom.judging import NONE_GUESSED, NONE_TITLE, Guess, Judgement, judged
from flexgui.classroom.truth import hide, truth_in_words
from flexgui.core.errors import InputError
from flexgui.core.scenario.read import parse_scenario
from flexgui.jobs import Event, Finished, Task
from flexgui.session.services import Services
from flexgui.session.state import Topic
from flexgui.stages.data.uploading import Uploading
from flexgui.stages.diagnose.effects import present, titled
from flexgui.views.ranking import sizes

SOURCE = "The challenge"
LONGEST_SIZE = 80

__all__ = [
    "NONE_GUESSED",
    "NONE_TITLE",
    "Challenge",
    "Challenging",
    "Guess",
    "Revealed",
    "ToolAnswer",
]


@dataclass(frozen=True)
class Revealed:
    """The end of a challenge."""

    truth: tuple[str, ...]
    """Lines."""
    judgement: Judgement
    asked: bool
    """Whether the tool had been asked before the truth was seen."""


@dataclass(frozen=True)
class ToolAnswer:
    """The tool's own verdict on the recordings of a challenge."""

    effects: tuple[str, ...]
    """Ids: what was added to the model, else the first of its list."""
    words: str
    whole: bool = True
    """Whether it has tried all that it knows; what was added is its last word, too."""


@dataclass(frozen=True)
class Challenge:
    """What a person was given; the truth stays obfuscated and never leaves the server before."""

    seed: int
    level: str
    sealed: str
    guesses: tuple[Guess, ...] = ()
    """Empty: none yet. They stand until the person asks to change them."""
    changing: bool = False
    """Whether the person is about to change them."""
    asked: bool = False
    """Whether the tool had been asked before they were committed to."""
    changed: bool = False
    """Whether others were committed to before."""
    revealed: Revealed | None = None
    started: float = field(default_factory=time.monotonic)

    @property
    def count(self) -> int:
        """How many effects are hidden at this level."""
        from flexgui.core.study.challenge import LEVELS

        return LEVELS[self.level][0] if self.level in LEVELS else 1

    def committed(self, guesses: tuple[Guess, ...], asked: bool) -> Challenge:
        """With these guesses; the same ones again change nothing, whatever the tool has said."""
        same = guesses == self.guesses
        return replace(
            self,
            guesses=guesses,
            changing=False,
            asked=self.asked or (asked and not same),
            changed=self.changed or (bool(self.guesses) and not same),
        )


class Challenging(Uploading, ABC):
    """At most one challenge, which a new scenario ends."""

    def __init__(self, key: str, folder: Path) -> None:
        super().__init__(key, folder)
        self.challenge: Challenge | None = None
        self.nickname = ""
        """On the class's board; empty: somebody."""
        self.tour: int | None = 0
        """The first visit's tour: 0 while it is offered, 1 once begun, None where dismissed."""
        self._unsubscribe: Callable[[], None] = lambda: None
        self._shelved: Challenge | None = None
        """Whose recordings made room for a person's own."""

    def hide(self, seed: int, level: str, services: Services) -> bool:
        """Starts over with recordings of an arm in which something is hidden."""
        task = Task.of(hide, SOURCE, seed=seed, level=level, folder=str(self.folder))

        def on_event(event: Event) -> None:
            if isinstance(event, Finished):
                self._hidden(Challenge(seed, level, event.result[1]), event.result[0], services)
                # It starts identified: everybody begins at the same question.
                if self.challenge is not None:
                    self.identify(services, lambda: self._ask_tool(services))

        return self._submit(services, "hide", task, on_event)

    def _hidden(self, made: Challenge, text: str, services: Services) -> None:
        run = self.run
        if not self.open(parse_scenario(text, SOURCE)):
            return
        with self._lock:
            self.challenge, self.run = made, run
        self._subscribe(services)
        self.notify(Topic.CHALLENGE, Topic.RUN)
        self.show_message(
            f"Challenge {made.seed} ({made.level}): something is hidden in these recordings."
        )

    def _subscribe(self, services: Services) -> None:
        """The board of this challenge's class moves while others work at it."""
        self._unsubscribe()
        self._unsubscribe = services.board.subscribe(lambda: self.notify(Topic.CHALLENGE))

    def use_arrived(self, alone: bool) -> bool:
        """Who uses own recordings alone leaves the challenge until its recordings come back."""
        if not super().use_arrived(alone):
            return False
        if alone and self.challenge is not None:
            with self._lock:
                self._shelved, self.challenge = self.challenge, None
            self.notify(Topic.CHALLENGE)
        return True

    def bring_back(self) -> bool:
        if not super().bring_back():
            return False
        if self._shelved is not None:
            with self._lock:
                self.challenge, self._shelved = self._shelved, None
            self.notify(Topic.CHALLENGE)
        return True

    def leave_waiting(self) -> None:
        super().leave_waiting()
        self._shelved = None

    def take_up(self, known: Challenge) -> None:
        """Another one's challenge, whose recordings are here already, from its beginning."""
        with self._lock:
            self.challenge = Challenge(known.seed, known.level, known.sealed)
        self.notify(Topic.CHALLENGE)

    def guess(self, guesses: tuple[Guess, ...], services: Services, name: str = "") -> bool:
        """Commits to an answer, which stands until `change_guess`."""
        known = self.challenge
        if known is None or known.revealed is not None:
            self.show_message("There is no challenge to guess at; hide an effect first.", bad=True)
            return False
        if known.guesses and not known.changing:
            self.show_message(
                "Your guess is recorded; press Change my guess first, which is marked.", bad=True
            )
            return False
        short = tuple(replace(one, size=one.size.strip()[:LONGEST_SIZE]) for one in guesses)
        unique = tuple({one.kind: one for one in short}.values())
        with self._lock:
            self.challenge = known.committed(unique, self.tool_asked)
            self.nickname = plain_name(name)
        self._subscribe(services)
        services.board.committed(known.seed, known.level, self.key)
        self.notify(Topic.CHALLENGE)
        return True

    def change_guess(self) -> bool:
        """Lets the person commit anew; another guess than before is noted on the board."""
        known = self.challenge
        if known is None or not known.guesses or known.revealed is not None:
            return False
        with self._lock:
            self.challenge = replace(known, changing=True)
        self.notify(Topic.CHALLENGE)
        return True

    @property
    def tool_asked(self) -> bool:
        """Whether the person has seen a ranking of these recordings."""
        return any(look.ranking for look in self.shown_looks)

    def reveal(self, services: Services) -> bool:
        """Reads the truth, after a guess; a tool that was not asked yet is asked now."""
        from flexgui.core.study.challenge import opened

        known = self.challenge
        if known is None or not known.guesses or known.changing:
            self.show_message("Guess first: the truth cannot be hidden again.", bad=True)
            return False
        if known.revealed is not None:
            return False
        try:
            text = opened(known.sealed, SOURCE)
        except InputError as error:
            self.show_message(str(error), bad=True)
            return False
        judgement = judged(known.guesses, json.loads(text))
        asked = self.tool_asked
        found = Revealed(tuple(truth_in_words(text).splitlines()), judgement, asked)
        with self._lock:
            self.challenge = replace(known, revealed=found)
        services.board.put(known.seed, known.level, self.key, self._entry(known, found))
        self.notify(Topic.CHALLENGE)
        self._ask_tool(services)
        return True

    def _ask_tool(self, services: Services) -> None:
        """Once the truth is known, where nobody has asked it yet and nothing else is computed."""
        known = self.challenge
        if known is None or known.revealed is None or known.revealed.asked:
            return
        if not (self.busy or self.tool_asked):
            self.diagnose(services)

    def _entry(self, known: Challenge, found: Revealed) -> Entry:
        judgement = found.judgement
        near = [one for one in judgement.each if one.right and one.size]
        return Entry(
            name=self.nickname,
            guess=", ".join(one.title for one in known.guesses),
            found=judgement.found,
            hidden=len(judgement.hidden),
            complete=judgement.complete,
            size="" if not near else "near" if all(one.near for one in near) else "far off",
            seconds=time.monotonic() - known.started,
            asked=known.asked,
            changed=known.changed,
        )

    @property
    def tool_answer(self) -> ToolAnswer | None:
        """As far as the looks at these recordings have come; None where none was taken."""
        first = next((look for look in self.shown_looks if look.ranking), None)
        if first is None:
            return None
        best = first.ranking[0]
        verdict = "still looking" if first.diagnosis is None else first.diagnosis.verdict
        size = f", {sizes(best)}" if best.parameters else ""
        words = f"{verdict.replace('_', ' ')}; first in its list: {best.title}{size}"
        added = [kind for kind, _ in present(self.scenario)]
        if added:
            words += f"; added: {', '.join(titled(added))}"
        tried = first.diagnosis is not None and not (first.found and first.found.to_come)
        return ToolAnswer(tuple(added) or (best.effect,), words, bool(added) or tried)

    def go_on_tour(self, step: int | None) -> None:
        """Offers or begins the tour; None dismisses it."""
        with self._lock:
            self.tour = step
        self.notify(Topic.TOUR)
