"""A challenge: hide an effect, guess, reveal."""

from __future__ import annotations

from markupsafe import Markup

from core.effects import catalogue
from core.study.challenge import LEVELS
from flexgui.panels import widgets
from flexgui.panels.desk import Desk
from flexgui.panels.words import Words, joined, paragraph
from flexgui.session.challenging import NONE_GUESSED, Challenge, Revealed

MOST = 99_999
SAID = (
    "The program hides an effect in an arm and records it; the same seed gives everybody the same "
    "data. Look, compare, diagnose – then commit to a guess and reveal."
)


class ChallengeControls:
    """Stands in a folder of its own."""

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        gui, session = desk.gui, desk.session
        self._titles = {e.title: kind for kind, e in catalogue().items()}
        self._folder = gui.add_folder("Challenge", expand_by_default=False)
        with self._folder:
            self._said = Words(gui, paragraph(SAID, "soft"))
            self._seed = gui.add_number("Seed", 4, min=0, max=MOST, step=1, disabled=desk.read_only)
            self._level = gui.add_dropdown("Level", tuple(LEVELS), disabled=desk.read_only)
            self._hide = widgets.button(desk, "Hide an effect", self._hidden)
            self._guess = gui.add_dropdown(
                "Your guess", (NONE_GUESSED, *sorted(self._titles)), disabled=desk.read_only
            )
            self._size = gui.add_text(
                "Its size", "", hint="With its unit, for instance fc1 = 0.2 N m.",
                disabled=desk.read_only,
            )  # fmt: skip
            self._commit = widgets.button(desk, "Commit to this guess", self._guessed)
            self._reveal = widgets.button(desk, "Reveal", session.reveal, prominent=True)
            self._truth = Words(gui)

    def _hidden(self) -> None:
        session, desk = self._desk.session, self._desk
        seed = self._seed.value
        if not isinstance(seed, int | float) or not 0 <= seed <= MOST:
            session.say(f"The seed must be a whole number from 0 to {MOST}.", bad=True)
            return
        session.hide(int(seed), str(self._level.value), desk.services)

    def _guessed(self) -> None:
        kind = self._titles.get(str(self._guess.value), NONE_GUESSED)
        self._desk.session.guess(kind, str(self._size.value))

    def refresh(self) -> None:
        """Shows what can be done next."""
        session = self._desk.session
        known = session.challenge
        self._hide.disabled = session.run.busy or self._desk.read_only
        self._hide.color = "blue" if known is None else "gray"
        for each in (self._guess, self._size, self._commit):
            each.visible = known is not None and known.revealed is None
        self._reveal.visible = known is not None and bool(known.guess) and known.revealed is None
        self._truth.show(Markup("") if known is None else self._told(known))

    def _told(self, known: Challenge) -> Markup:
        head = paragraph(f"Challenge {known.seed}, {known.level}.", "lead")
        if not known.guess:
            return joined(head, paragraph("You have not guessed yet."))
        one = catalogue().get(known.guess)
        title = "nothing is hidden" if one is None else one.title
        guess = f"Your guess: {title}{', ' + known.size if known.size else ''}."
        parts = [head, paragraph(guess)]
        return joined(*parts, *(() if known.revealed is None else _revealed(known.revealed)))


def _revealed(found: Revealed) -> tuple[Markup, ...]:
    judged = "You found it." if found.guessed_right else "That was not it."
    lines = Markup("").join(Markup("<br>{}").format(line) for line in found.truth[1:])
    truth = Markup("<p><b>The truth</b>{}</p>").format(lines)
    kind = "good" if found.guessed_right else "bad"
    return (paragraph(judged, kind), truth, paragraph(found.tool))
