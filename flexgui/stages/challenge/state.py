"""A hidden effect to be found: the data, a guess, and what was true."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from flexgui.core.errors import InputError
from flexgui.core.scenario.read import parse_scenario
from flexgui.jobs import Event, Finished, Task
from flexgui.session.state import Topic
from flexgui.stages.challenge.judging import (
    NONE_GUESSED,
    NONE_TITLE,
    Entry,
    Guess,
    Judgement,
    hide,
    judged,
    plain_name,
    truth_in_words,
)
from flexgui.stages.diagnose.effects import present, titled
from flexgui.views.ranking import sizes

if TYPE_CHECKING:
    from flexgui.session.session import Session

SOURCE = "The challenge"
LONGEST_SIZE = 80

__all__ = [
    "NONE_GUESSED",
    "NONE_TITLE",
    "Challenge",
    "Challenges",
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


class Challenges:
    """At most one challenge, which a new scenario ends."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.nickname = ""
        """On the class's board; empty: somebody."""
        self._unsubscribe: Callable[[], None] = lambda: None
        self.reset()

    def reset(self) -> None:
        """Another scenario follows, or none."""
        self._unsubscribe()
        self.state: Challenge | None = None
        self._aside: Challenge | None = None
        """Whose recordings made room for a person's own."""

    def hide(self, seed: int, level: str) -> bool:
        """Starts over with recordings of an arm in which something is hidden."""
        task = Task.of(hide, SOURCE, seed=seed, level=level, folder=str(self._session.folder))

        def on_event(event: Event) -> None:
            if isinstance(event, Finished):
                self._hidden(Challenge(seed, level, event.result[1]), event.result[0])
                # It starts identified: everybody begins at the same question.
                if self.state is not None:
                    self._session.identification.start(self._ask_tool)

        return self._session.run.submit("hide", task, on_event)

    def _hidden(self, made: Challenge, text: str) -> None:
        run = self._session.run.state
        if not self._session.open(parse_scenario(text, SOURCE)):
            return
        with self._session.lock:
            self.state, self._session.run.state = made, run
        self._subscribe()
        self._session.notify(Topic.CHALLENGE, Topic.RUN)
        self._session.show_message(
            f"Challenge {made.seed} ({made.level}): these recordings hide an effect."
        )

    def _subscribe(self) -> None:
        """The board of this challenge's class moves while others work at it."""
        self._unsubscribe()
        board = self._session.services.board
        self._unsubscribe = board.subscribe(lambda: self._session.notify(Topic.CHALLENGE))

    def lay_aside(self) -> None:
        """Who uses own recordings alone leaves the challenge until its recordings come back."""
        if self.state is not None:
            with self._session.lock:
                self._aside, self.state = self.state, None
            self._session.notify(Topic.CHALLENGE)

    def take_back(self) -> None:
        """Its recordings are back."""
        if self._aside is not None:
            with self._session.lock:
                self.state, self._aside = self._aside, None
            self._session.notify(Topic.CHALLENGE)

    def take_up(self, known: Challenge) -> None:
        """Another one's challenge, whose recordings are here already, from its beginning."""
        with self._session.lock:
            self.state = Challenge(known.seed, known.level, known.sealed)
        self._session.notify(Topic.CHALLENGE)

    def guess(self, guesses: tuple[Guess, ...], name: str = "") -> bool:
        """Commits to an answer, which stands until `change_guess`."""
        known = self.state
        if known is None or known.revealed is not None:
            return self._session.refuse("There is no challenge yet; hide an effect first.")
        if known.guesses and not known.changing:
            return self._session.refuse(
                "Your guess is recorded. Press Change my guess first; the board marks a change."
            )
        short = tuple(replace(one, size=one.size.strip()[:LONGEST_SIZE]) for one in guesses)
        unique = tuple({one.kind: one for one in short}.values())
        with self._session.lock:
            self.state = known.committed(unique, self.tool_asked)
            self.nickname = plain_name(name)
        self._subscribe()
        self._session.services.board.committed(known.seed, known.level, self._session.key)
        self._session.notify(Topic.CHALLENGE)
        return True

    def change_guess(self) -> bool:
        """Lets the person commit anew; another guess than before is noted on the board."""
        known = self.state
        if known is None or not known.guesses or known.revealed is not None:
            return False
        with self._session.lock:
            self.state = replace(known, changing=True)
        self._session.notify(Topic.CHALLENGE)
        return True

    @property
    def tool_asked(self) -> bool:
        """Whether the person has seen a ranking of these recordings."""
        return any(version.ranking for version in self._session.diagnosis.shown_versions)

    def reveal(self) -> bool:
        """Reads the truth, after a guess; a tool that was not asked yet is asked now."""
        from flexgui.core.study.challenge import reveal

        known = self.state
        if known is None or not known.guesses or known.changing:
            return self._session.refuse("Guess first: you cannot hide the truth again.")
        if known.revealed is not None:
            return False
        try:
            text = reveal(known.sealed, SOURCE)
        except InputError as error:
            return self._session.refuse(error)
        judgement = judged(known.guesses, json.loads(text))
        asked = self.tool_asked
        found = Revealed(tuple(truth_in_words(text, names=False).splitlines()), judgement, asked)
        with self._session.lock:
            self.state = replace(known, revealed=found)
        self._session.services.board.put(
            known.seed, known.level, self._session.key, self._entry(known, found)
        )
        self._session.notify(Topic.CHALLENGE)
        self._ask_tool()
        return True

    def _ask_tool(self) -> None:
        """Once the truth is known, where nobody has asked it yet and nothing else is computed."""
        known = self.state
        if known is None or known.revealed is None or known.revealed.asked:
            return
        if not (self._session.run.busy or self.tool_asked):
            self._session.diagnosis.search()

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
        """The ranking so far for these recordings; None without one."""
        first = next(
            (version for version in self._session.diagnosis.shown_versions if version.ranking), None
        )
        if first is None:
            return None
        best = first.ranking[0]
        verdict = "still looking" if first.diagnosis is None else first.diagnosis.verdict
        size = f", {sizes(best)}" if best.parameters else ""
        words = f"{verdict.replace('_', ' ')}; first in its list: {best.title}{size}"
        added = [kind for kind, _ in present(self._session.document.scenario)]
        if added:
            words += f"; added: {', '.join(titled(added))}"
        tried = first.diagnosis is not None and not (first.found and first.found.to_come)
        return ToolAnswer(tuple(added) or (best.effect,), words, bool(added) or tried)
