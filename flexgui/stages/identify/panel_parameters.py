"""Which parameters are estimated, within which bounds, and what is known of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any

from flexgui.core.errors import InputError
from flexgui.core.parameters import Parameter
from flexgui.page.actions import press
from flexgui.page.panel import PageContext, PageElement
from flexgui.page.widgets import HtmlBlock, RebuiltFolder, bind, number, on_user_input, set_options
from flexgui.sentences.written import ShownUnit, shown_unit
from flexgui.session.scenario_edits import ScenarioDict, cached_model, set_value
from flexgui.stages.identify.state import candidates, stated
from flexgui.views.names import plain_symbol

ADD = "add a parameter …"


def parameter_text(p: Parameter) -> str:
    """'bending stiffness of segment 1, EI₁'"""
    symbol = plain_symbol(p.symbol, p.name)
    return f"{p.title}, {symbol}" if p.title else symbol


class ChosenParameters(PageElement):
    """Rebuilt when other parameters are chosen; else its fields follow the session."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        context.actions.register("hold", self._remove)
        self._rows = RebuiltFolder(context)
        self._free: dict[str, str] = {}
        """Words -> name of what could be estimated too."""
        self._add: Any = self.gui.add_dropdown("Add", (ADD,))
        on_user_input(context, self._add, self._added)

    def refresh(self) -> None:
        """Shows what the scenario states."""
        scenario = self.session.document.scenario
        try:
            model = cached_model(scenario)
        except InputError:
            return
        chosen = scenario.identify.parameters
        free = {parameter_text(p): n for n, p in candidates(model).items() if n not in chosen}
        self._free = free
        set_options(self._add, (ADD, *free), ADD)
        rows = partial(self._build_rows, stated(scenario, model))
        self._rows.make((chosen, scenario.arm.preset), rows)

    def _build_rows(self, parameters: Sequence[Parameter]) -> None:
        for p in parameters:
            self._row(p)

    def _row(self, p: Parameter) -> None:
        context, name = self.context, p.name
        unit = shown_unit(p.value or p.upper, p.unit)
        symbol = plain_symbol(p.symbol, name)
        bounds = self.gui.add_vector2(
            unit.label(symbol), self._bounds(name, unit), step=_step(p, unit),
            hint=f"{p.title or name}: bounds, from and to.",
        )  # fmt: skip
        bind(
            context, bounds, partial(self._bounds, name, unit),
            partial(self._put_bounds, name, unit),
        )  # fmt: skip
        number(
            context, f"± {symbol}, prior", (0.0, math.inf, None),
            lambda: self._prior(name) * unit.factor,
            lambda v: self._put("prior", name, v / unit.factor or None),
            "Standard deviation of the prior; 0: no prior.",
        )  # fmt: skip
        HtmlBlock(self.gui, press(f"Do not estimate {symbol}", "hold", name, "link"))

    def _put(self, setting: str, name: str, value: Any) -> bool:
        return self.session.document.change(set_value(("identify", setting, name), value))

    def _usual(self, name: str) -> Parameter:
        """With the bounds that it has where none are stated."""
        return cached_model(self.session.document.scenario).parameters[name]

    def _bounds(self, name: str, unit: ShownUnit) -> tuple[float, float]:
        usual, bounds = self._usual(name), self.session.document.scenario.identify.bounds
        return _shown(bounds.get(name, (usual.lower, usual.upper)), unit)

    def _put_bounds(self, name: str, unit: ShownUnit, ends: Sequence[float]) -> bool:
        """The usual ones are not stated."""
        usual = self._usual(name)
        are_usual = tuple(map(float, ends)) == _shown((usual.lower, usual.upper), unit)
        values = None if are_usual else [float(v) / unit.factor for v in ends]
        return self._put("bounds", name, values)

    def _prior(self, name: str) -> float:
        prior = self.session.document.scenario.identify.prior.get(name)
        return 0.0 if prior is None else prior.std

    def _remove(self, name: str) -> bool:
        """What is not estimated is not removed either."""

        def edit(document: ScenarioDict) -> None:
            table = document.setdefault("identify", {})
            table["parameters"] = [n for n in table.get("parameters", ()) if n != name]
            for setting in ("bounds", "prior"):
                table.get(setting, {}).pop(name, None)

        return self.session.document.change(edit)

    def _added(self) -> None:
        document, name = self.session.document, self._free.get(str(self._add.value))
        if name is not None:
            names = [*document.scenario.identify.parameters, name]
            document.change(set_value(("identify", "parameters"), names))


def _shown(bounds: tuple[float, float], unit: ShownUnit) -> tuple[float, float]:
    return _plain(bounds[0] * unit.factor), _plain(bounds[1] * unit.factor)


def _plain(value: float) -> float:
    """As many digits as a field shows."""
    return float(f"{value:.4g}")


def _step(p: Parameter, unit: ShownUnit) -> float:
    size = abs(p.value * unit.factor) or 1.0
    return float(10.0 ** round(math.log10(size) - 2))
