"""On Data: which kind of rig it is, and its data sheet with a drawing of the arm."""

from __future__ import annotations

from markupsafe import Markup

from flexgui.core.arm.arm import MOST_SEGMENTS
from flexgui.core.arm.build import build_arm
from flexgui.core.scenario.schema import Scenario
from flexgui.page.actions import press, selection
from flexgui.page.panel import PageContext, PageElement
from flexgui.page.widgets import HtmlBlock, joined
from flexgui.stages.data.panel_own import WORDS
from flexgui.stages.data.rig_sheet import SheetRow, estimated, is_stated, sheet_rows
from flexgui.stages.data.rigs import RIGS, arm_choices, rig_of
from flexgui.views.rig_drawing import rig_drawing

STATED = {"": "As stated"}
"""Of an arm or a rig that is none of the lists."""
STATE = "State this rig"
FOLD = Markup("<details data-fold='rig sheet'><summary>Data sheet of the rig</summary>{}</details>")


def rig_choices(scenario: Scenario) -> Markup:
    """Dropdowns for rig and arm, which decide which signals a file must hold."""
    rig, arm = rig_of(scenario), build_arm(scenario.arm)
    rigs = {one.title: one.title for one in RIGS}
    arms = {preset: title for title, preset in arm_choices().items()}
    preset = "" if is_stated(scenario) else scenario.arm.preset or ""
    title = "" if rig is None else rig.title
    rows = [("Rig", "rig", rigs, title), ("Arm", "arm", arms, preset)]
    if arm.segments[0].joint != "prismatic":
        links = {str(n): str(n) for n in range(1, MOST_SEGMENTS + 1)}
        rows.append(("Links", "rig links", links, str(arm.joints)))
    return Markup("<div class='choices'>{}</div>").format(
        joined(*(
            selection(label, action, choices if value in choices else STATED | choices, value)
            for label, action, choices, value in rows
        ))
    )  # fmt: skip


class RigForm(PageElement):
    """Kind of rig, drawing and data sheet; asks for the sheet where the arm is only an example."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        rig = self.session.recordings.rig
        context.actions.register("rig", rig.choose_kind)
        context.actions.register("arm", rig.choose_arm)
        context.actions.register("rig links", rig.choose_links)
        context.actions.register("state rig", rig.state)
        self._form = HtmlBlock(self.gui)

    def refresh(self) -> None:
        """Shows the present values, and entries that were refused as they were typed."""
        session = self.session
        scenario, rig = session.document.scenario, session.recordings.rig
        if session.recordings.waiting is not None:
            self._form.show("")
            return
        asked = rig.is_asked
        sheet = WORDS.sheet(
            rig_drawing(build_arm(scenario.arm)), tables(sheet_rows(scenario)),
            estimated(scenario), rig.refused, rig.complaint, asked,
            press(STATE, "state rig", kind="main" if asked else ""),
        )  # fmt: skip
        content = sheet if asked or rig.complaint else FOLD.format(sheet)
        self._form.show(rig_choices(scenario), content)


def tables(rows: tuple[SheetRow, ...]) -> list[tuple[str, int, list[SheetRow]]]:
    """(what a column is of, columns, rows) of the sheet's parts that have equal columns."""
    words = {"segments": "Link", "drive": "Joint"}
    parts: dict[tuple[str, int], list[SheetRow]] = {}
    for row in rows:
        parts.setdefault((words.get(row.table, ""), len(row.values)), []).append(row)
    return [(word, count, part) for (word, count), part in parts.items()]
