"""On Diagnose: all models of the session in one table, to return to or to draw beside."""

from __future__ import annotations

import time
from typing import Any

from flexgui.page.panel import PageContext, PageElement
from flexgui.page.widgets import HtmlBlock, bind
from flexgui.session.settings import made_with
from flexgui.stages.diagnose.fitted_models import FittedModel, errors_of, evidence_of
from flexgui.stages.diagnose.panel_candidates import WORDS


class ModelTable(PageElement):
    """A row per diagnosed model; shown once there is another than the present one."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        diagnosis = self.session.diagnosis
        context.actions.register("return to model", lambda k: diagnosis.return_to(_number(k)))
        context.actions.register("model beside", lambda k: self._toggle(_number(k)))
        self._folder = self.gui.add_folder("Models of this session", visible=False)
        with self._folder:
            self._rows = HtmlBlock(self.gui)
            hint = "Of the model in bold."
            self._field: Any = self.gui.add_text("Name", "", hint=hint)
            bind(context, self._field, self._name, diagnosis.models.rename)

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
        models, comparable = diagnosis.models.listed, diagnosis.models.comparable
        present = next((m for m in comparable if m is diagnosis.models.present), None)
        self._folder.visible = len(models) > (present is not None)
        self._field.visible = present is not None
        rows = [self._row(m, present if m in comparable else None) for m in models]
        self._rows.show(WORDS.models(rows, present, diagnosis.models.beside, able))

    def _row(self, model: FittedModel, like: FittedModel | None) -> tuple[object, ...]:
        """The model, its errors and its evidence against the noise of `like`, when it was fitted,
        and with which other settings."""
        made, now = model.version.scenario, self.session.document.scenario
        others = made_with(made, now.model_copy(update={"model": made.model}))
        version = None if like is None else like.version
        return model, errors_of(model, version), evidence_of(model, version), _date(model), others


def _number(text: str) -> int:
    return int(text) if text.isdecimal() else 0


def _date(model: FittedModel) -> str:
    """'14:32', with the day if it was not today."""
    then = time.localtime(model.made)
    today = then[:3] == time.localtime()[:3]
    return time.strftime("%H:%M" if today else "%d %b %H:%M", then)
