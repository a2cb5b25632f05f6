"""A challenge: hide an effect, guess, reveal, and see who found what."""

from __future__ import annotations

from typing import Any

from flexgui.core.challenge.truth import LEVELS
from flexgui.core.effects import catalogue
from flexgui.core.errors import InputError
from flexgui.page.panel import PageContext, PageElement, Panel
from flexgui.page.widgets import HtmlBlock, button, color, on_user_input, paragraph, stage_macros
from flexgui.session.state import Topic
from flexgui.stages.challenge.board import board_table, plain_name
from flexgui.stages.challenge.judging import (
    NONE_GUESSED,
    NONE_TITLE,
    Guess,
    Judgement,
    SizeField,
    size_fields,
)
from flexgui.stages.challenge.state import Challenge
from flexgui.stages.diagnose.panel import DemonstrationView
from flexgui.stages.diagnose.panel_candidates import WORDS as DIAGNOSE_WORDS
from flexgui.views.table import html_table

WORDS = stage_macros("challenge")
LARGEST_SEED = 99_999
EASY_SEED = 30
"""Easy to begin with: one effect that shows well, another one than the tour's."""

EXPLANATION = (
    "The program hides an effect in an arm and records it. The same seed gives everybody the same "
    "data. Look, compare, commit to a guess, reveal. The board marks who changed the guess."
)
AFTER = "After you reveal it, the hidden effect is shown here on the recordings."
NAME_IT = (
    "Your name or a nickname? The class's board shows it beside your guess; without one it shows "
    "“somebody”."
)
NO_SECOND = "no second effect"


class ChallengePanel(Panel):
    """Right: start, guess, board. Left, after the reveal: the hidden effect at work."""

    kind = "Challenge"
    topics = frozenset({Topic.CHALLENGE, Topic.RUN, Topic.DEMONSTRATION})

    def build_controls(self) -> None:
        context, gui = self.context, self.gui
        self._drawn: Challenge | None = None
        self._form = gui.add_folder(None, visible=False)
        with self._form:
            self._guess_controls()
        HtmlBlock(gui, paragraph(EXPLANATION, "soft"))
        self._seed = gui.add_number("Seed", EASY_SEED, min=0, max=LARGEST_SEED, step=1)
        self._level = gui.add_dropdown("Level", tuple(LEVELS))
        self._hide = button(context, "Hide an effect", self._hidden)

    def build_plots(self) -> None:
        self._hint = HtmlBlock(self.gui)
        self._at_work = DemonstrationView(self.context)
        self._shown: Judgement | None = None

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
        self._truth, self._board = HtmlBlock(gui), HtmlBlock(gui)

    def _hidden(self) -> None:
        seed = self._seed.value
        if not isinstance(seed, int | float) or not 0 <= seed <= LARGEST_SEED:
            self.session.refuse(f"The seed must be a whole number from 0 to {LARGEST_SEED}.")
            return
        self.session.challenge.hide(int(seed), str(self._level.value))

    def _guessed(self) -> None:
        challenge = self.session.challenge
        second = challenge.state is not None and challenge.state.count > 1
        fields = self._fields[: 1 + (second and bool(self._fields[1].kind))]
        entered = [field.guess() for field in fields]
        guesses = tuple(guess for guess in entered if guess is not None)
        if len(guesses) == len(entered):
            challenge.guess(guesses, str(self._name.value))

    def _revealed(self) -> None:
        name, challenge = str(self._name.value), self.session.challenge
        if self._name.visible and name.strip():
            challenge.nickname = plain_name(name)
        challenge.reveal()

    def refresh(self) -> None:
        """Shows the next possible actions."""
        session, state = self.session, self.session.challenge.state
        self.enable(not session.run.busy, self._hide)
        self._hide.color = color(state is None)
        if state is not None:
            # Fields first: a folder that comes is measured with what is in it.
            self._show_fields(state)
            self._show_words(state)
        self._form.visible = state is not None
        self._at_work.refresh()
        revealed = None if state is None else state.revealed
        self._hint.show("" if revealed else paragraph(AFTER, "soft"))
        if revealed is not self._shown:
            self._shown = revealed
            if state is not None and revealed is not None and not self.context.read_only:
                session.demonstration.start(revealed.hidden[0], state.truth.values)

    def _show_words(self, state: Challenge) -> None:
        revealed = state.revealed
        self._state.show(WORDS.state(state))
        self._truth.show(WORDS.end(revealed) if revealed else "")
        board = self.session.services.board
        entries = board.entries(state.seed, state.level)
        waiting = board.guessing(state.seed, state.level)
        table = html_table(board_table(entries, waiting))
        self._board.show(WORDS.board(state, entries, waiting, table).strip())

    def _show_fields(self, state: Challenge) -> None:
        """Shows the fields of the guess, or the buttons after it."""
        nickname, committed = self.session.challenge.nickname, bool(state.guesses)
        stands = state.revealed is None and committed and not state.changing
        asks = state.revealed is None and not stands
        if asks and state.changing and self._drawn != state:
            for fields, guess in zip(self._fields, state.guesses, strict=False):
                fields.fill(guess)
            self._name.value = nickname
        self._drawn = state
        self._fields[0].show(asks)
        self._fields[1].show(asks and state.count > 1)
        nameless = asks or (stands and not nickname)
        self._nameless.show(paragraph(NAME_IT if nameless else "", "soft"))
        self._name.visible, self._commit.visible = nameless, asks
        self._reveal.visible = self._change.visible = stands


class GuessFields(PageElement):
    """Fields for one guess; `none` is the choice besides the effects."""

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
        """Id of the chosen effect; empty for none."""
        return self._kinds.get(str(self._kind.value), "")

    def guess(self) -> Guess | None:
        """The entered guess; None, with an error beside the field, if its size is not a number."""
        parameter = self._parameter()
        try:
            size = None if parameter is None else parameter.stated(str(self._size.value))
        except InputError as error:
            self._refused.show(paragraph(str(error), "bad"))
            return None
        self._refused.show()
        return Guess(self.kind or NONE_GUESSED, size)

    def fill(self, guess: Guess) -> None:
        """Shows an earlier guess again, for example after a reload."""
        effect = catalogue().get(guess.kind)
        self._kind.value = self._none if effect is None else effect.title
        self._chosen()
        if guess.size is not None:
            titles = {p.name: p.title for p in size_fields(guess.kind)}
            self._of.value = titles[guess.size.name]
            self._size.value = f"{guess.size.value:.10g}"
        self._name_field()

    def show(self, visible: bool) -> None:
        """Shows or hides all fields."""
        self._shown = visible
        self._kind.visible = visible
        parameter = self._parameter()
        self._of.visible = self._size.visible = visible and parameter is not None
        effect = catalogue().get(self.kind)
        self._story.show(DIAGNOSE_WORDS.explanation(effect) if visible else "")
        if not visible:
            self._refused.show()

    def _chosen(self) -> None:
        """Shows the parameters of the newly chosen effect."""
        titles = tuple(p.title for p in size_fields(self.kind)) or ("–",)
        if self._of.options != titles:
            self._of.options = titles
        self._refused.show()
        self._name_field()
        self.show(self._shown)

    def _name_field(self) -> None:
        parameter = self._parameter()
        if parameter is not None:
            self._size.label = parameter.label

    def _parameter(self) -> SizeField | None:
        parameters = size_fields(self.kind)
        chosen = [p for p in parameters if p.title == self._of.value]
        return chosen[0] if chosen else parameters[0] if parameters else None
