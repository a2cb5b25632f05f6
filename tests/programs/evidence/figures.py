"""Figures of the evidence as SVG; the same records give the same bytes."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
mpl.rcParams.update({"svg.hashsalt": "flexgui", "font.size": 9, "svg.fonttype": "none"})

from matplotlib.figure import Figure  # noqa: E402

BLUE, GREY, RED = "#1f5fa8", "#9aa5b1", "#b3372c"
NOTHING = "nothing"


def svg(figure: Figure) -> str:
    """Without a date inside."""
    out = io.StringIO()
    figure.savefig(out, format="svg", bbox_inches="tight", metadata={"Date": None})
    return out.getvalue()


def ladder(steps: Sequence[Sequence[Any]], floor: float, unit: str) -> Figure:
    """What each step leaves, down to the noise floor."""
    figure = Figure(figsize=(5.0, 2.2))
    axes = figure.subplots()
    names = [name.replace("_", " ") for name, _ in steps]
    axes.barh(names, [rms for _, rms in steps], color=BLUE)
    axes.axvline(floor, color=RED, label="noise floor")
    axes.invert_yaxis()
    axes.set_xscale("log")
    axes.set_xlabel(f"residual [{unit} rms]")
    axes.legend(frameon=False)
    return figure


def beside(names: Sequence[str], ours: Sequence[float], judged: Sequence[float]) -> Figure:
    """Two errors in mm per estimator: what was seen, and what was not."""
    figure = Figure(figsize=(5.5, 2.8))
    axes = figure.subplots()
    places = np.arange(len(names))
    axes.barh(places - 0.2, ours, 0.4, color=GREY, label="halves of the first recording")
    axes.barh(places + 0.2, judged, 0.4, color=BLUE, label="pulses, not seen")
    axes.set_yticks(places, names)
    axes.invert_yaxis()
    axes.set_xlabel("free run's error [mm rms]")
    axes.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    return figure


def curves(lines: Mapping[str, tuple[Sequence[int], Sequence[Mapping[str, float]]]]) -> Figure:
    """Processor time and memory of each size over the smallest size, a line per kind of size."""
    figure = Figure(figsize=(6.5, 2.6), layout="constrained")
    for axes, name, label in zip(
        figure.subplots(1, 2), ("cpu", "memory"), ("processor time [s]", "memory [MB]"), strict=True
    ):
        for color, (kind, (sizes, runs)) in zip((BLUE, GREY, RED), lines.items(), strict=False):
            times = [size / sizes[0] for size in sizes]
            axes.plot(times, [run[name] for run in runs], "o-", color=color, label=kind)
        axes.set_xticks(times, [f"{k:g} x" for k in times])
        axes.set_xlabel("size over the smallest")
        axes.set_ylabel(label)
        axes.set_ylim(bottom=0.0)
        axes.legend(frameon=False)
    return figure


def confusion(pairs: Sequence[tuple[str, str]]) -> Figure:
    """How often what is hidden (rows) came first as what (columns)."""
    count: dict[tuple[str, str], int] = {}
    for pair in pairs:
        count[pair] = count.get(pair, 0) + 1
    rows = sorted({row for row, _ in pairs})
    columns = sorted({column for _, column in pairs} | set(rows))
    size = (1.6 + 0.3 * len(columns), 1.2 + 0.3 * len(rows))
    figure = Figure(figsize=size)
    axes = figure.subplots()
    for (row, column), n in count.items():
        at = columns.index(column), rows.index(row)
        axes.add_patch(
            mpl.patches.Rectangle(
                (at[0] - 0.5, at[1] - 0.5), 1, 1, color=BLUE if row == column else RED
            )
        )
        axes.text(*at, str(n), ha="center", va="center", color="white")
    axes.set_xlim(-0.5, len(columns) - 0.5)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xticks(range(len(columns)), [_plain(c) for c in columns], rotation=90)
    axes.set_yticks(range(len(rows)), [_plain(r) for r in rows])
    axes.set_xlabel("named first")
    axes.set_ylabel("hidden")
    return figure


def _plain(name: str) -> str:
    return name.replace("_", " ")


def first_named(found: Mapping[str, Mapping[str, Any]]) -> list[tuple[str, str]]:
    """(hidden, named first) of the cases with one hidden effect or none; empty where all hide the
    same, which leaves nothing to confuse."""
    pairs = [
        (next(iter(one["truth"]), NOTHING), one["first"] or NOTHING)
        for one in found.values()
        if len(one["truth"]) < 2
    ]
    return pairs if len({hidden for hidden, _ in pairs}) > 1 else []
