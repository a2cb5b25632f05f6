"""The stages of the work as a row of buttons, the newest message below it, and their style."""

from __future__ import annotations

from markupsafe import Markup

from flexgui.page.in_browser import PURPOSE
from flexgui.page.panel import PageContext
from flexgui.page.widgets import Words, joined, paragraph
from flexgui.session.state import OURS, STAGES, Part

PURPOSE_LINE = Markup("<p class='purpose'>{}</p>").format(PURPOSE)
FOLLOWS = Markup("<p class='follows'><b>You follow the teacher.</b> {}</p>").format(
    "Stages and settings are the teacher's. Turn the arm with the mouse as you like; take your own "
    "copy to change things. It stays yours after a reload."
)
BAR = Markup("<span class='fx-bar'></span>")


class StageBar:
    """Stands on top of the main panel."""

    def __init__(self, context: PageContext) -> None:
        self._context = context
        Words(context.gui, FOLLOWS if context.read_only else PURPOSE_LINE)
        self._mark = Words(context.gui, self._style())
        self._buttons = context.gui.add_button_group("Stage", STAGES)
        if not context.read_only:
            self._buttons.on_click(lambda _: context.session.show(str(self._buttons.value)))
        self._message, self._old = Words(context.gui), Words(context.gui)

    def refresh(self) -> None:
        """Shows which stage is active, the newest message, and what is not up to date."""
        self._mark.show(self._style())
        message = self._context.session.message
        kind = "bad" if message.bad else "good"
        self._message.show(paragraph(message.text, kind) if message.text else "")

        self._old.show(not_updated(self._context.session.faults.old | self._context.faults.old))

    def _style(self) -> Markup:
        follows = FOLLOWER if self._context.read_only else Markup("")
        return joined(STYLE, follows, bar_style(STAGES.index(self._context.session.stage)), BAR)


IN_FIGURES = {Part.MODEL, Part.PLAYBACK, Part.STUDY, Part.PLOTS, Part.LATE_PLOTS}
OLD_FIGURES = Markup("""<style>.js-plotly-plot, .uplot { opacity: .45; position: relative; }
:is(.js-plotly-plot, .uplot)::before { content: "may be old"; position: absolute; z-index: 2;
  left: 50%; font-weight: 700; }</style>""")


def not_updated(parts: frozenset[Part]) -> Markup:
    """Says which parts of the page show an older state, and marks its figures where they do."""
    if not parts:
        return Markup("")
    words = ", ".join(sorted(part.value for part in parts))
    sentence = f"{words[0].upper()}{words[1:]} could not be updated and may be old: {OURS}."
    return joined(paragraph(sentence, "bad"), OLD_FIGURES if parts & IN_FIGURES else "")


STYLE = Markup("""<style>
:root { --fx-good: #157356; --fx-bad: #b3261e; --fx-warn: #a85505; --fx-link: #1864ab;
  --fx-focus: #1864ab; }
:root[data-mantine-color-scheme="light"] { --mantine-color-dimmed: #565e68;
  --mantine-color-blue-filled: #1971c2; --mantine-color-blue-filled-hover: #1864ab;
  --mantine-primary-color-filled: #1971c2; --mantine-primary-color-filled-hover: #1864ab;
  --mantine-color-blue-outline: #1864ab; --mantine-color-blue-text: #1864ab;
  --mantine-color-placeholder: #6b737c; }
:root[data-mantine-color-scheme="dark"] { --mantine-color-dimmed: #b3bbc4; --fx-good: #4cc9a0;
  --fx-bad: #ff8f87; --fx-warn: #f0a45d; --fx-link: #74b4e8; --fx-focus: #74b4e8;
  --mantine-color-placeholder: #a0a8b0; }
/* What can be pressed is large enough for a finger and shows when a key would press it. */
.mantine-Button-root, .mantine-Input-input, .mantine-ActionIcon-root, .mantine-CloseButton-root {
  min-height: 32px !important; }
.mantine-ActionIcon-root, .mantine-CloseButton-root { min-width: 32px !important; }
.mantine-Slider-thumb::after { content: ""; position: absolute; inset: -11px -13px; }
.mantine-Checkbox-input { width: 24px !important; height: 24px !important; }
:focus-visible { outline: 3px solid var(--fx-focus) !important; outline-offset: 1px !important; }
/* viser squeezes its labels. */
.mantine-Text-root:has(> label), .mantine-Input-input { letter-spacing: normal !important; }
.mantine-Slider-markLabel { font-size: .72rem !important; color: var(--mantine-color-dimmed); }
.mantine-Button-label { white-space: normal !important; line-height: 1.25; text-align: center; }
.mantine-Button-root[data-block] { height: auto !important; padding-block: .3em; }
/* One button of a stage invites; all others stay quiet. */
.mantine-Button-root[style*="gray-filled"]:not([data-disabled]) {
  --button-bg: var(--mantine-color-body) !important; --button-bd: 1px solid #868e96 !important;
  --button-color: var(--mantine-color-text) !important;
  --button-hover: var(--mantine-color-default-hover) !important;
  --button-hover-color: var(--mantine-color-text) !important; }
/* Figures: their text follows the theme; hover boxes have a ground of their own. */
.js-plotly-plot .main-svg text { fill: var(--mantine-color-dimmed) !important; }
.js-plotly-plot .hoverlayer text { fill: #f4f6f8 !important; }
#fx-links { position: fixed; top: 8px; left: 8px; z-index: 9; display: flex; gap: 6px; }
#fx-links button { min-height: 32px; padding: 0 .8em; font: inherit; font-size: .85em;
  border-radius: 16px; border: 1px solid #868e96; background: var(--mantine-color-body);
  color: var(--mantine-color-text); }
/* The time-line's inputs in one row; their options say what they are. */
div:has(> div > .fx > .fx-line) { display: flex; flex-wrap: wrap; }
div:has(> div > .fx > .fx-line) > * { flex: 1 0 100%; min-width: 0; box-sizing: border-box; }
div:has(> div > .fx > .fx-line) > :nth-child(6) { flex: 3 1 10em; }
div:has(> div > .fx > .fx-line) > :is(:nth-child(4), :nth-child(5)) { flex: 1 1 5.4em; }
div:has(> div > .fx > .fx-line) > :is(:nth-child(4), :nth-child(5)) { padding-right: 0; }
div:has(> div > .fx > .fx-line) > :nth-child(n+3) div:has(> .mantine-Text-root > label) {
  position: absolute !important; width: 1px !important; height: 1px; overflow: hidden;
  clip-path: inset(50%); padding: 0; }
[role="tab"], [role="tab"] * { color: var(--fx-link) !important; }
.fx .follows { margin: 0; padding: .4em .7em; border-left: 4px solid var(--fx-link);
  background: rgba(25,113,194,.10); }
.fx .purpose { margin: 0; font-size: .95em; font-weight: 500; }
div:has(> .fx > .tour.pair) + div, div:has(> .fx > .tour.pair) + div + div {
  width: calc(50% - 15px); }
div:has(> .fx > .tour.pair) + div + div { position: relative; left: calc(50% - 5px);
  margin-top: calc(-32px - .5em); }
.fx { padding: 0 .75em .35em; font-size: .875em; line-height: 1.4; color: var(--mantine-color-text);
  overflow-wrap: anywhere; max-width: 100%; box-sizing: border-box; }
.fx p { margin: .25em 0; } .fx h4 { margin: .9em 0 .25em; font-size: .95em; }
.fx .soft { color: var(--mantine-color-dimmed); font-size: .93em; }
.fx .lead { font-size: 1.05em; font-weight: 600; }
.fx .bad, .fx .good { border-left: 3px solid var(--fx-bad); padding: .3em .6em;
  background: rgba(214,69,69,.10); }
.fx .good { border-color: var(--fx-good); background: rgba(31,148,112,.10); }
.fx .alarm { color: var(--fx-bad); font-weight: 600; }
.fx ul { margin: .2em 0; padding-left: 1.2em; }
.fx .scroll { overflow-x: auto; container-type: inline-size; }
@container (max-width: 500px) { .fx table { font-size: .75em; }
  .fx th, .fx td { padding-right: .5em !important; } }
/* The bar that scrolls a panel stands beside its buttons, not on them. */
.mantine-ScrollArea-viewport > div:has(.fx-bar) { padding-right: 8px; box-sizing: border-box; }
.fx table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .93em; }
.fx th, .fx td { padding: .18em .8em .18em 0; text-align: left; white-space: nowrap;
  border-bottom: 1px solid var(--mantine-color-default-border); }
.fx thead th { white-space: normal; overflow-wrap: normal; vertical-align: bottom; }
.fx th { font-weight: 600; color: var(--mantine-color-dimmed); }
.fx .number { text-align: right; } .fx tr.strong td { font-weight: 650; }
.fx td.best { font-weight: 700; color: var(--fx-good); }
.fx table.matrix { font-size: .8em; }
.fx table.matrix td, .fx table.matrix th { text-align: right; }
.fx .formula { overflow-x: auto; padding: .2em 0; }
.fx math { font-size: .95rem; font-family: "Latin Modern Math", "STIX Two Math",
  "Cambria Math", math, serif; }
.fx .formula math { display: inline math; }
.fx mtable { margin: 0 .2em; padding: 0 .25em; }
.fx mtable.square, .fx mtable.bars, .fx mtable.round { border-left: 1.5px solid;
  border-right: 1.5px solid; }
.fx mtable:not(.square, .bars, .round) > mtr > mtd:last-child { text-align: left; }
.fx mtable.round { border-radius: .7em; }
.fx mtable.square { background:
    linear-gradient(currentColor, currentColor) top left / .35em 1.5px,
    linear-gradient(currentColor, currentColor) bottom left / .35em 1.5px,
    linear-gradient(currentColor, currentColor) top right / .35em 1.5px,
    linear-gradient(currentColor, currentColor) bottom right / .35em 1.5px;
  background-repeat: no-repeat; }
.fx .key { display: inline-block; width: .8em; height: .8em; border-radius: 2px;
  margin: 0 .35em 0 .7em; vertical-align: -.05em; }
.fx .glimpse { display: block; background: var(--mantine-color-default-hover);
  border-radius: 4px; margin-top: .2em; }
.fx .spark { display: block; max-width: 100%; background: var(--mantine-color-default-hover);
  border-radius: 4px; margin: .2em 0; }
.fx table.signals { width: 100%; }
.fx table.signals td { white-space: normal; vertical-align: top; padding-right: .5em; }
.fx summary { cursor: pointer; color: var(--fx-link); font-weight: 600; padding: .25em 0; }
.fx .rank { display: flex; gap: .6em; align-items: baseline; margin-top: .5em; }
.fx .rank b { font-size: 1.08em; flex: 1; } .fx .rank i { font-style: normal; font-weight: 700; }
.fx .verdict { border-left: 4px solid #7d858f; padding: .25em .7em; margin: .3em 0; }
.fx .verdict.missing, .fx .verdict.unlisted { border-color: #d9730d;
  background: rgba(217,115,13,.10); }
.fx .verdict.nothing_missing { border-color: #1f9470; background: rgba(31,148,112,.10); }
.uplot .u-title { text-align: left; padding: .2em .5em 0; font-size: 12px; font-weight: 400;
  color: var(--mantine-color-dimmed); }
.uplot .u-legend { min-height: 3.9em; }
.uplot:not(:hover) .u-value, .uplot:not(:hover) .u-series:first-child { display: none; }
.uplot:not(:hover) .u-series > th::after { content: none !important; }
.fx .tour { border: 1.5px solid var(--mantine-primary-color-filled); border-radius: 6px;
  padding: .4em .8em; }
.mantine-Slider-root:has([data-disabled]) ~ div input { opacity: .5; pointer-events: none; }
div:has(> .fx > .fx-bar) + div > div > div:first-child { display: none; }
div:has(> .fx > .fx-bar) + div button { font-size: .8em; padding: 0 .2em; }
@media (max-width: 36em) {
  .mantine-Paper-root[style*="position: fixed"][style*="width: 20em"]:has(.fx) {
    width: 100vw !important; }
  .mantine-Paper-root[style*="position: fixed"]:has(.fx) div[style="width: 20em;"] {
    width: 100% !important; }
  /* The arm keeps the upper half. */
  .mantine-Paper-root[style*="position: fixed"]:has(.fx-bar) { max-height: 50% !important; }
  /* No plot makes its panel wider than the screen. */
  .mantine-ScrollArea-content:has(.fx) { min-width: 0; }
}
@media (max-width: 75em) {
  div:has(> .fx > .fx-bar) + div button { font-size: .7em; padding: 0; }
}
</style>""")
"""`:has` finds the row of buttons after the mark `fx-bar`; a browser without it shows a label."""


FOLLOWER = Markup("""<style>
div:has(> .fx > .fx-bar) + div button { opacity: .6; cursor: not-allowed; }
</style>""")
"""The stages are the teacher's choice."""


def bar_style(active: int) -> Markup:
    """Fills the active one of the stage's buttons."""
    return Markup(
        "<style>div:has(> .fx > .fx-bar) + div button:nth-child({}) {{"
        " background: var(--mantine-primary-color-filled); color: white; }}</style>"
    ).format(active + 1)
