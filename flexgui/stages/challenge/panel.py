"""A challenge: hide an effect, guess, reveal, and see who found what."""

from __future__ import annotations

from functools import cache
from typing import Any

from flexgui.core.effects import catalogue
from flexgui.core.errors import InputError
from flexgui.core.study.challenge import LEVELS
from flexgui.export.template import environment
from flexgui.page.panel import PageContext, PageElement, Panel
from flexgui.page.widgets import HtmlBlock, button, color, on_user_input, paragraph
from flexgui.sentences.figures import validation_rms
from flexgui.session.state import Topic
from flexgui.stages.challenge.judging import (
    NONE_GUESSED,
    AskedSize,
    Guess,
    asked_sizes,
    plain_name,
    read_sizes,
)
from flexgui.stages.challenge.state import NONE_TITLE, Challenge, Revealed, ToolAnswer
from flexgui.stages.diagnose.effects import titled
from flexgui.stages.diagnose.panel import AtWork
from flexgui.stages.diagnose.panel_candidates import WORDS as DIAGNOSE_WORDS
from flexgui.views.summary import validation_words
from flexgui.views.table import html_table

MOST = 99_999
SEED = 30
"""Easy to begin with: one effect that shows well, another one than the tour's."""

EXPLANATION = (
    "The program hides an effect in an arm and records it. The same seed gives everybody the same "
    "data. Look, compare, commit to a guess, use the tool, reveal. The board marks who used the "
    "tool before guessing."
)
AFTER = "After you reveal it, the hidden effect is shown here on the recordings."
NAME_IT = (
    "Your name or a nickname? The class's board shows it beside your guess; without one it shows "
    "“somebody”."
)
NO_SECOND = "no second effect"


class ChallengePanel(Panel):
    """How to begin one, the guess and who found what on the right; on the left, once it is
    revealed, what the hidden effect does to these recordings."""

    kind = "Challenge"
    topics = frozenset({Topic.CHALLENGE, Topic.RUN, Topic.DIAGNOSIS, Topic.DEMONSTRATION})

    def build_controls(self) -> None:
        context, gui = self.context, self.gui
        self._drawn: Challenge | None = None
        self._form = gui.add_folder(None, visible=False)
        with self._form:
            self._guess_controls()
        HtmlBlock(gui, paragraph(EXPLANATION, "soft"))
        self._seed = gui.add_number("Seed", SEED, min=0, max=MOST, step=1)
        self._level = gui.add_dropdown("Level", tuple(LEVELS))
        self._hide = button(context, "Hide an effect", self._hidden)

    def build_plots(self) -> None:
        self._hint = HtmlBlock(self.gui)
        self._at_work = AtWork(self.context)
        self._shown: Revealed | None = None

    def _guess_controls(self) -> None:
        context, gui = self.context, self.gui
        self._state = HtmlBlock(gui)
        self._fields = (
            GuessFields(context, "Your guess", NONE_TITLE),
            GuessFields(context, "And", NO_SECOND),
        )
        self._name: Any = gui.add_text(
            "Your name", "", hint="On the class's board; a nickname is enough."
        )
        self._nameless = HtmlBlock(gui)
        self._commit = button(context, "Commit to this guess", self._guessed, prominent=True)
        self._reveal = button(context, "Reveal", self._revealed, prominent=True)
        self._change = button(
            context, "Change my guess (it is marked)", self.session.challenge.change_guess
        )
        self._take = button(
            context, "Hand in (file)", self._handed_in,
            hint="Your guess as a file for grading. Reveal does not change it.",
        )  # fmt: skip
        self._truth, self._board = HtmlBlock(gui), HtmlBlock(gui)

    def _hidden(self) -> None:
        seed = self._seed.value
        if not isinstance(seed, int | float) or not 0 <= seed <= MOST:
            self.session.refuse(f"The seed must be a whole number from 0 to {MOST}.")
            return
        self.session.challenge.hide(int(seed), str(self._level.value))

    def _guessed(self) -> None:
        challenge = self.session.challenge
        second = challenge.state is not None and challenge.state.count > 1
        fields = self._fields[: 1 + (second and bool(self._fields[1].kind))]
        found = [one.guess() for one in fields]
        guesses = tuple(one for one in found if one is not None)
        if len(guesses) == len(found):
            challenge.guess(guesses, str(self._name.value))

    def _revealed(self) -> None:
        name, challenge = str(self._name.value), self.session.challenge
        if self._name.visible and name.strip():
            challenge.nickname = plain_name(name)
        challenge.reveal()

    def _handed_in(self) -> None:
        challenge = self.session.challenge
        known = challenge.state
        if known is None or not known.guesses:
            return
        from flexgui.classroom.hand_in import HandIn  # late: few hand anything in

        name = challenge.nickname or plain_name(str(self._name.value))
        given = HandIn(name, known.guesses, known.sealed, known.asked, known.changed)
        self.send(given.filename, given.text().encode())

    def refresh(self) -> None:
        """Shows what can be done next."""
        session, known = self.session, self.session.challenge.state
        self.enable(not session.run.busy, self._hide)
        self._hide.color = color(known is None)
        if known is not None:
            # Fields first: a folder that comes is measured with what is in it.
            self._show_fields(known)
            self._show_words(known)
        self._form.visible = known is not None
        self._at_work.refresh()
        revealed = None if known is None else known.revealed
        self._hint.show("" if revealed else paragraph(AFTER, "soft"))
        if revealed is not self._shown:
            self._shown = revealed
            hidden = revealed.judgement.hidden if revealed else ()
            if hidden and not self.context.read_only:
                session.demonstration.start(hidden[0])

    def _show_words(self, known: Challenge) -> None:
        session, words = self.session, _words()
        version, tool, improvement = session.diagnosis.newest, session.challenge.tool_answer, ""
        if version is not None and version.found is not None:
            improvement = validation_words(version.error, validation_rms(version.found.step.errors))
        self._state.show(words.state(known, session.challenge.tool_asked, improvement))
        found = known.revealed
        self._truth.show(words.end(found, _verdict(found, tool, session.run.busy)) if found else "")
        board = session.services.board
        entries = board.entries(known.seed, known.level)
        waiting = board.guessing(known.seed, known.level)
        from flexgui.classroom.board import board_table  # late: only a class has entries

        table = html_table(board_table(entries, waiting))
        self._board.show(words.board(known, entries, waiting, table).strip())

    def _show_fields(self, known: Challenge) -> None:
        """Either the fields, or what may follow a guess that stands."""
        nickname, committed = self.session.challenge.nickname, bool(known.guesses)
        stands = known.revealed is None and committed and not known.changing
        asks = known.revealed is None and not stands
        if asks and known.changing and self._drawn != known:
            for fields, guess in zip(self._fields, known.guesses, strict=False):
                fields.fill(guess)
            self._name.value = nickname
        self._drawn = known
        self._fields[0].show(asks)
        self._fields[1].show(asks and known.count > 1)
        nameless = asks or (stands and not nickname)
        self._nameless.show(paragraph(NAME_IT if nameless else "", "soft"))
        self._name.visible, self._commit.visible = nameless, asks
        self._reveal.visible = self._change.visible = stands
        self._take.visible = committed and not known.changing


@cache
def _words() -> Any:
    return environment().get_template("challenge.html.j2").module


def _verdict(found: Revealed, tool: ToolAnswer | None, busy: bool) -> str:
    """The tool's, judged the same way as a person's."""
    if busy and (tool is None or not tool.whole):
        return "It is examining the recordings."
    if tool is None:
        return "It was not used."
    late = "" if found.asked else " (used only now)"
    if not tool.whole:
        return f"Stopped early{late}: {tool.words}."
    hidden = found.judgement.hidden
    missed = [kind for kind in hidden if kind not in tool.effects]
    mark = "✓" if not missed else "✓ in part:" if len(missed) < len(hidden) else "✗"
    rest = f" Not named: {', '.join(titled(missed))}." if missed else ""
    return f"{mark} Verdict{late}: {tool.words}.{rest}"


class GuessFields(PageElement):
    """Stands in the folder that is open; `none` is what may be chosen besides an effect."""

    def __init__(self, context: PageContext, label: str, none: str) -> None:
        super().__init__(context)
        gui = self.gui
        self._none = none
        self._kinds = {e.title: kind for kind, e in catalogue().items()}
        self._kind: Any = gui.add_dropdown(label, (none, *sorted(self._kinds)))
        self._of: Any = gui.add_dropdown("Size of", ("–",), hint="Choose one of its parameters.")
        self._size: Any = gui.add_text("is", "", hint="A number in this unit, or empty.")
        self._refused, self._story = HtmlBlock(gui), HtmlBlock(gui)
        self._shown = True
        on_user_input(context, self._kind, self._chosen)
        on_user_input(context, self._of, self._name_field)
        on_user_input(context, self._size, self._refused.show)
        self._chosen()

    @property
    def kind(self) -> str:
        """Of the effect that is chosen; empty where none is."""
        return self._kinds.get(str(self._kind.value), "")

    def guess(self) -> Guess | None:
        """What stands in the fields; None, and a sentence beside the field, where its size is no
        number."""
        one = self._parameter()
        try:
            size = "" if one is None else one.stated(str(self._size.value))
        except InputError as error:
            self._refused.show(paragraph(str(error), "bad"))
            return None
        self._refused.show()
        return Guess(self.kind or NONE_GUESSED, size)

    def fill(self, guess: Guess) -> None:
        """Shows a guess that was made before, such as ahead of a reload."""
        known = catalogue().get(guess.kind)
        self._kind.value = self._none if known is None else known.title
        self._chosen()
        for name, value, _ in read_sizes(guess.size):
            titles = [one.title for one in asked_sizes(guess.kind) if one.name == name]
            if titles:
                self._of.value, self._size.value = titles[0], f"{value:.10g}"
        self._name_field()

    def show(self, visible: bool) -> None:
        """All fields, or none."""
        self._shown = visible
        self._kind.visible = visible
        one = self._parameter()
        self._of.visible = self._size.visible = visible and one is not None
        effect = catalogue().get(self.kind)
        self._story.show(DIAGNOSE_WORDS.explanation(effect) if visible else "")
        if not visible:
            self._refused.show()

    def _chosen(self) -> None:
        """Another effect has other parameters."""
        titles = tuple(one.title for one in asked_sizes(self.kind)) or ("–",)
        if self._of.options != titles:
            self._of.options = titles
        self._refused.show()
        self._name_field()
        self.show(self._shown)

    def _name_field(self) -> None:
        one = self._parameter()
        if one is not None:
            self._size.label = one.label

    def _parameter(self) -> AskedSize | None:
        found = asked_sizes(self.kind)
        chosen = [one for one in found if one.title == self._of.value]
        return chosen[0] if chosen else found[0] if found else None
