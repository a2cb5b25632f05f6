"""A challenge: hide an effect, guess, reveal, and see who found what."""

from __future__ import annotations

from typing import Any

from markupsafe import Markup

from core.effects import catalogue
from core.study.challenge import LEVELS
from flexgui.panels import widgets
from flexgui.panels.desk import Desk
from flexgui.panels.words import Words, joined, paragraph
from flexgui.session.challenging import NONE_GUESSED, Challenge, Guess, Revealed, ToolSaid
from flexgui.session.effects import titled
from flexgui.session.judging import Judged
from flexgui.views.board import board_table
from flexgui.views.html import html_table

MOST = 99_999
SAID = (
    "The program hides an effect in an arm and records it; the same seed gives everybody the same "
    "data. Look, compare, diagnose – then commit to a guess and reveal."
)
NO_SECOND = "no second effect"


class ChallengeControls:
    """Stands in a folder of its own."""

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        gui = desk.gui
        self._titles = {e.title: kind for kind, e in catalogue().items()}
        self._folder = gui.add_folder("Challenge", expand_by_default=False)
        with self._folder:
            self._said = Words(gui, paragraph(SAID, "soft"))
            self._seed = gui.add_number("Seed", 4, min=0, max=MOST, step=1, disabled=desk.read_only)
            self._level = gui.add_dropdown("Level", tuple(LEVELS), disabled=desk.read_only)
            self._hide = widgets.button(desk, "Hide an effect", self._hidden)
            self._state = Words(gui)
            self._guess, self._size = self._fields("Your guess", NONE_GUESSED)
            self._second, self._second_size = self._fields("And", NO_SECOND)
            self._name = gui.add_text(
                "Your name", "", hint="On the class's board; may stay empty.",
                disabled=desk.read_only,
            )  # fmt: skip
            self._commit = widgets.button(desk, "Commit to this guess", self._guessed)
            self._reveal = widgets.button(
                desk, "Reveal", lambda: desk.session.reveal(desk.services), prominent=True
            )
            self._truth, self._board = Words(gui), Words(gui)

    def _fields(self, label: str, none: str) -> tuple[Any, Any]:
        """An effect and its size."""
        gui, off = self._desk.gui, self._desk.read_only
        kind = gui.add_dropdown(label, (none, *sorted(self._titles)), disabled=off)
        hint = "With its unit, for instance fc1 = 0.2 N m."
        return kind, gui.add_text("Its size", "", hint=hint, disabled=off)

    def _hidden(self) -> None:
        session, desk = self._desk.session, self._desk
        seed = self._seed.value
        if not isinstance(seed, int | float) or not 0 <= seed <= MOST:
            session.say(f"The seed must be a whole number from 0 to {MOST}.", bad=True)
            return
        session.hide(int(seed), str(self._level.value), desk.services)

    def _guessed(self) -> None:
        known, desk = self._desk.session.challenge, self._desk
        first = self._titles.get(str(self._guess.value), NONE_GUESSED)
        guesses = [Guess(first, str(self._size.value))]
        second = self._titles.get(str(self._second.value))
        if second is not None and known is not None and known.count > 1:
            guesses.append(Guess(second, str(self._second_size.value)))
        desk.session.guess(tuple(guesses), desk.services, str(self._name.value))

    def refresh(self) -> None:
        """Shows what can be done next."""
        session = self._desk.session
        known = session.challenge
        # A stage that comes back unfolds its folders as stated: who has a challenge wants it open.
        if self._folder.expand_by_default != (known is not None):
            self._folder.expand_by_default = known is not None
        self._hide.disabled = session.run.busy or self._desk.read_only
        self._hide.color = "blue" if known is None else "gray"
        open_ = known is not None and known.revealed is None
        for each in (self._guess, self._size, self._name, self._commit):
            each.visible = open_
        for each in (self._second, self._second_size):
            each.visible = open_ and known is not None and known.count > 1
        guessed = open_ and known is not None and bool(known.guesses)
        self._reveal.visible = guessed
        self._commit.color = "gray" if guessed else "blue"
        self._state.show("" if known is None else _state(known))
        self._truth.show("" if known is None else _end(known, session.tool_said, session.run.busy))
        self._board.show("" if known is None else self._class(known))

    def _class(self, known: Challenge) -> Markup:
        """What others found, told to those who know the truth; before it only how many there
        are."""
        board = self._desk.services.board
        entries = board.entries(known.seed, known.level)
        waiting = board.guessing(known.seed, known.level)
        if not entries and waiting <= bool(known.guesses):
            return Markup("")
        if known.revealed is None:
            text = f"In this class {waiting} committed to a guess, {len(entries)} saw the truth."
            return paragraph(text, "soft")
        table = board_table(entries, waiting)
        return joined(Markup("<h4>Who found what</h4>"), html_table(table))


def _state(known: Challenge) -> Markup:
    head = paragraph(f"Challenge {known.seed}, {known.level}.", "lead")
    if not known.guesses:
        return joined(head, paragraph("You have not guessed yet."))
    if known.revealed is not None:
        return head
    return joined(head, paragraph(f"Your guess: {_guess_words(known)}.", "good"))


def _guess_words(known: Challenge) -> str:
    return "; ".join(g.title + (f", {g.size}" if g.size else "") for g in known.guesses)


def _end(known: Challenge, tool: ToolSaid | None, busy: bool) -> Markup:
    """Truth, guess and the tool's verdict side by side."""
    found = known.revealed
    if found is None:
        return Markup("")
    lines = Markup("").join(Markup("<br>{}").format(line.lstrip(" -")) for line in found.truth[1:])
    judgement = found.judgement
    kind = "good" if judgement.complete else "bad"
    return joined(
        paragraph(judgement.sentence, kind),
        Markup("<h4>The truth</h4><p>{}</p>").format(lines.removeprefix(Markup("<br>"))),
        Markup("<h4>You</h4>"),
        *(paragraph(_judged(one)) for one in judgement.each),
        Markup("<h4>The tool</h4>"),
        *_tool(found, tool, busy),
    )


def _judged(one: Judged) -> str:
    mark = "✓" if one.right else "✗"
    if not one.right:
        return f"{mark} {one.guess.title}"
    return f"{mark} {one.guess.title}: {one.size}." if one.size else f"{mark} {one.guess.title}."


def _tool(found: Revealed, tool: ToolSaid | None, busy: bool) -> list[Markup]:
    """Its verdict, judged the same way."""
    if tool is None:
        return [paragraph("It looks at the recordings now." if busy else "It was not asked.")]
    hidden = found.judgement.hidden
    right = [kind for kind in tool.effects if kind in hidden]
    mark = "✓" if len(right) == len(hidden) else "✓ in part:" if right else "✗"
    late = "" if found.asked else " (asked only now)"
    missed = [kind for kind in hidden if kind not in tool.effects]
    rest = f" Not named: {', '.join(titled(missed))}." if missed else ""
    return [paragraph(f"{mark} Verdict{late}: {tool.words}.{rest}")]
