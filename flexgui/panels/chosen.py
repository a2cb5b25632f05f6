"""The parameters to estimate, each with its bounds and what is believed of it."""

from __future__ import annotations

import math
from typing import Any

from core.errors import InputError
from core.parameters import Parameter
from core.workbench import base_model
from core.written import ShownUnit, shown_unit
from flexgui.panels import widgets
from flexgui.panels.page_context import PageContext
from flexgui.panels.rebuilt import Rebuilt
from flexgui.session.edit import Document, put
from flexgui.session.identified import candidates, stated
from flexgui.views.names import plain_symbol

ADD = "add a parameter …"


class ChosenParameters:
    """Rebuilt when other parameters are chosen; else its fields follow the session."""

    def __init__(self, desk: PageContext) -> None:
        self._desk = desk
        self._rows = Rebuilt(desk, desk.gui.add_folder(None))
        self._add: Any = desk.gui.add_dropdown("Add", (ADD,))
        if not desk.read_only:
            self._add.on_update(self._added)

    def refresh(self) -> None:
        """Shows what the scenario states."""
        scenario = self._desk.session.scenario
        try:
            model = base_model(scenario)
        except InputError:
            return
        chosen = stated(scenario, model)
        left = [n for n in candidates(model) if n not in scenario.identify.parameters]
        shape = (scenario.identify.parameters, scenario.arm.preset)
        if self._add.options != (ADD, *left):
            self._add.options = (ADD, *left)
        self._add.value = ADD

        def build() -> None:
            for parameter in chosen:
                self._row(parameter)

        self._rows.make(shape, build)

    def _row(self, p: Parameter) -> None:
        desk, session, name = self._desk, self._desk.session, p.name
        unit = shown_unit(p.value or p.upper, p.unit)
        symbol = plain_symbol(p.symbol, name)
        bounds = desk.gui.add_vector2(
            unit.label(symbol), self._bounds(name, p, unit), step=_step(p, unit),
            hint=f"{p.title or name}: bounds, from and to.",
        )  # fmt: skip

        def set_bounds(value: tuple[float, float]) -> bool:
            ends = [float(v) / unit.factor for v in value]
            return session.change(put(("identify", "bounds", name), ends))

        widgets.bind(desk, bounds, lambda: self._bounds(name, p, unit), set_bounds)
        widgets.number(
            desk, f"± {symbol}, known", lambda: self._prior(name) * unit.factor,
            lambda v: session.change(put(("identify", "prior", name), v / unit.factor or None)),
            least=0.0, hint="Standard deviation of the prior knowledge; 0: none.",
        )  # fmt: skip
        widgets.button(desk, f"Do not estimate {symbol}", lambda: self._remove(name))

    def _bounds(self, name: str, p: Parameter, unit: ShownUnit) -> tuple[float, float]:
        low, high = self._desk.session.scenario.identify.bounds.get(name, (p.lower, p.upper))
        return _plain(low * unit.factor), _plain(high * unit.factor)

    def _prior(self, name: str) -> float:
        prior = self._desk.session.scenario.identify.prior.get(name)
        return 0.0 if prior is None else prior.std

    def _remove(self, name: str) -> bool:
        def edit(document: Document) -> None:
            table = document.setdefault("identify", {})
            table["parameters"] = [n for n in table.get("parameters", ()) if n != name]
            for setting in ("bounds", "prior"):
                table.get(setting, {}).pop(name, None)

        return self._desk.session.change(edit)

    def _added(self, event: Any) -> None:
        name = str(self._add.value)
        if event.client_id is None or name == ADD:
            return
        session = self._desk.session
        names = [*session.scenario.identify.parameters, name]
        session.change(put(("identify", "parameters"), names))


def _plain(value: float) -> float:
    """As many digits as a field shows."""
    return float(f"{value:.4g}")


def _step(p: Parameter, unit: ShownUnit) -> float:
    size = abs(p.value * unit.factor) or 1.0
    return float(10.0 ** round(math.log10(size) - 2))
