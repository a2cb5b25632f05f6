"""Step response: what the arm does after a unit step of each reference."""

from __future__ import annotations

from core.simulate.response import StepResponse
from core.written import split_name
from flexgui.views.live import Figure
from flexgui.views.names import TITLES, channel_symbol
from flexgui.views.pairs import pair_lines, per_reference
from flexgui.views.small import small_axis, small_figure
from flexgui.views.units import shown_unit


def step(response: StepResponse) -> Figure:
    """Each output over time in s (or ms), per unit of the stepped reference."""
    clock = shown_unit(response.time, "s")
    unit = shown_unit(response.values, response.outputs[0].unit)
    symbol = ", ".join(channel_symbol(port.name) for port in response.outputs)
    traces = pair_lines(
        response.time * clock.factor, response.values * unit.factor,
        response.outputs, response.references, f"%{{y:.4g}} {unit.name}",
    )  # fmt: skip
    name = f"{symbol} [{per_reference(unit, response.references)}]"
    what = TITLES.get(split_name(response.outputs[0].name)[0], "output")
    return small_figure(
        traces,
        small_axis(clock.label("time"), range=[0.0, float(response.time[-1]) * clock.factor]),
        small_axis(name),
        f"Unit step of each reference; shown is the {what}.",
        hovermode="x unified",
    )
