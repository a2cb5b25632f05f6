"""On Diagnose: all models of the session in one table, to return to or to draw beside."""

from __future__ import annotations

import time
from typing import Any

from flexgui.page.panel import PageContext, PageElement
from flexgui.page.widgets import HtmlBlock, bind
from flexgui.stages.diagnose.fitted_models import FittedModel, errors_of, evidence_of
from flexgui.stages.diagnose.panel_candidates import WORDS


class ModelTable(PageElement):
    """A row per fitted model; shown once there are two."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        diagnosis = self.session.diagnosis
        context.actions.register("return to model", lambda k: diagnosis.return_to(_number(k)))
        context.actions.register("model beside", lambda k: self._toggle(_number(k)))
        self._folder = self.gui.add_folder("Models of this session", visible=False)
        with self._folder:
            self._rows = HtmlBlock(self.gui)
            hint = "Of the model in bold."
            field: Any = self.gui.add_text("Name", "", hint=hint)
            bind(context, field, self._name, diagnosis.models.rename)

    def _name(self) -> str:
        present = self.session.diagnosis.models.present
        return "" if present is None else present.title

    def _toggle(self, number: int) -> None:
        models = self.session.diagnosis.models
        shown = models.beside is not None and models.beside.number == number
        models.show_beside(None if shown else number)

    def refresh(self, able: bool) -> None:
        """`able`: whether another model can be made the present one now."""
        diagnosis = self.session.diagnosis
        models, present = diagnosis.models.comparable, diagnosis.models.present
        self._folder.visible = len(models) > 1
        if len(models) < 2:
            return
        like = None if present is None else present.version
        rows = [(m, errors_of(m, like), evidence_of(m, like), _date(m)) for m in models]
        self._rows.show(WORDS.models(rows, present, diagnosis.models.beside, able))


def _number(text: str) -> int:
    return int(text) if text.isdecimal() else 0


def _date(model: FittedModel) -> str:
    """'14:32', with the day if it was not today."""
    then = time.localtime(model.made)
    today = then[:3] == time.localtime()[:3]
    return time.strftime("%H:%M" if today else "%d %b %H:%M", then)
