"""The look of the page's own HTML; colours follow the browser's light or dark theme."""

from markupsafe import Markup

STYLE = Markup("""<style>
.fx { padding: 0 .75em .35em; font-size: .875em; line-height: 1.4; color: var(--mantine-color-text);
  overflow-wrap: anywhere; max-width: 100%; box-sizing: border-box; }
.fx p { margin: .25em 0; } .fx h4 { margin: .9em 0 .25em; font-size: .95em; }
.fx .soft { color: var(--mantine-color-dimmed); font-size: .93em; }
.fx .lead { font-size: 1.05em; font-weight: 600; }
.fx .bad { border-left: 3px solid #d64545; padding: .3em .6em; background: rgba(214,69,69,.10); }
.fx .good { border-left: 3px solid #1f9470; padding: .3em .6em; background: rgba(31,148,112,.10); }
.fx ul { margin: .2em 0; padding-left: 1.2em; }
.fx .scroll { overflow-x: auto; }
.fx table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .93em; }
.fx th, .fx td { padding: .18em .8em .18em 0; text-align: left; white-space: nowrap;
  border-bottom: 1px solid var(--mantine-color-default-border); }
.fx thead th { white-space: normal; overflow-wrap: normal; vertical-align: bottom; }
.fx th { font-weight: 600; color: var(--mantine-color-dimmed); }
.fx .number { text-align: right; } .fx tr.strong td { font-weight: 650; }
.fx td.best { font-weight: 700; color: #1f9470; }
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
.fx summary { cursor: pointer; color: var(--mantine-primary-color-filled); font-weight: 600; }
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
div:has(> .fx > .fx-bar) + div button { height: 2.1em; font-size: .8em; padding: 0 .2em; }
@media (max-width: 36em) {
  .mantine-Paper-root[style*="position: fixed"][style*="width: 20em"]:has(.fx),
  .mantine-Paper-root[style*="position: fixed"]:has(.fx) div[style="width: 20em;"] {
    width: 100vw !important; }
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
