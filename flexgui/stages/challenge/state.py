"""State of a challenge: its data, the guesses and the revealed truth."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from flexgui.core.challenge.truth import Truth
from flexgui.jobs import Event, Finished, Task
from flexgui.session.state import Topic
from flexgui.stages.challenge.board import Entry, plain_name
from flexgui.stages.challenge.judging import Guess, Judgement, hide, judge

if TYPE_CHECKING:
    from flexgui.core.scenario.schema import Scenario
    from flexgui.session.session import Session

SOURCE = "The challenge"


@dataclass(frozen=True)
class Challenge:
    """A challenge; the truth stays on the server until it is revealed."""

    seed: int
    level: str
    truth: Truth
    guesses: tuple[Guess, ...] = ()
    """Empty: none yet. They stand until the person asks to change them."""
    changing: bool = False
    """Whether the person is about to change them."""
    changed: bool = False
    """Whether others were committed to before."""
    revealed: Judgement | None = None
    started: float = field(default_factory=time.time)
    """s, Unix time."""

    @property
    def count(self) -> int:
        """How many effects are hidden."""
        return len(self.truth.effects)

    def committed(self, guesses: tuple[Guess, ...]) -> Challenge:
        """With these guesses; the same guesses again change nothing."""
        changed = self.changed or self.guesses not in ((), guesses)
        return replace(self, guesses=guesses, changing=False, changed=changed)


class Challenges:
    """At most one challenge per session; a new scenario ends it."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.nickname = ""
        """On the class's board; empty: somebody."""
        self._unsubscribe: Callable[[], None] = lambda: None
        self.reset()

    def reset(self) -> None:
        """Ends the challenge."""
        self._unsubscribe()
        self.state: Challenge | None = None

    def hide(self, seed: int, level: str) -> bool:
        """Starts a challenge: simulates recordings of an arm with hidden effects."""
        task = Task.of(hide, SOURCE, seed=seed, level=level, folder=str(self._session.folder))

        def on_event(event: Event) -> None:
            if isinstance(event, Finished):
                self._hidden(Challenge(seed, level, event.result[1]), event.result[0])
                # It starts identified: everybody begins at the same question.
                if self.state is not None:
                    self._session.identification.start()

        return self._session.run.submit("hide", task, on_event)

    def _hidden(self, made: Challenge, scenario: Scenario) -> None:
        run = self._session.run.state
        if not self._session.open(scenario):
            return
        with self._session.lock:
            self.state, self._session.run.state = made, run
        self._subscribe()
        self._session.notify(Topic.CHALLENGE, Topic.RUN)
        self._session.show_message(
            f"Challenge {made.seed} ({made.level}): these recordings hide an effect."
        )

    def _subscribe(self) -> None:
        """Updates the board when others in the class guess or reveal."""
        self._unsubscribe()
        board = self._session.services.board
        self._unsubscribe = board.subscribe(lambda: self._session.notify(Topic.CHALLENGE))

    def go_on(self, challenge: Challenge | None) -> None:
        """Continues one that another scenario had ended; None: there was none."""
        self.state = challenge
        if challenge is not None:
            self._subscribe()

    def take_up(self, challenge: Challenge) -> None:
        """Starts another session's challenge, whose recordings are here already."""
        with self._session.changing(Topic.CHALLENGE):
            self.state = Challenge(challenge.seed, challenge.level, challenge.truth)

    def guess(self, guesses: tuple[Guess, ...], name: str = "") -> bool:
        """Commits to guesses; `change_guess` allows others."""
        state = self.state
        if state is None or state.revealed is not None:
            return self._session.refuse("There is no challenge yet; hide an effect first.")
        if state.guesses and not state.changing:
            return self._session.refuse(
                "Your guess is recorded. Press Change my guess first; the board marks a change."
            )
        unique = tuple({guess.kind: guess for guess in guesses}.values())
        with self._session.lock:
            self.state = state.committed(unique)
            self.nickname = plain_name(name)
        self._subscribe()
        self._session.services.board.note(state.seed, state.level, self._session.key)
        self._session.notify(Topic.CHALLENGE)
        return True

    def change_guess(self) -> bool:
        """Allows another guess; the board marks the change."""
        state = self.state
        if state is None or not state.guesses or state.revealed is not None:
            return False
        with self._session.changing(Topic.CHALLENGE):
            self.state = replace(state, changing=True)
        return True

    def reveal(self) -> bool:
        """Reveals the truth after a guess."""
        state = self.state
        if state is None or not state.guesses or state.changing:
            return self._session.refuse("Guess first: you cannot hide the truth again.")
        if state.revealed is not None:
            return False
        judgement = judge(state.guesses, state.truth)
        with self._session.lock:
            self.state = replace(state, revealed=judgement)
        entry = Entry(self.nickname, judgement, time.time() - state.started, state.changed)
        self._session.services.board.note(state.seed, state.level, self._session.key, entry)
        self._session.notify(Topic.CHALLENGE)
        return True
