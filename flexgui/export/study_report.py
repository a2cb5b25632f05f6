"""The report of a study: one page that works without a network, and its tables."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

from core.errors import InputError
from core.montecarlo.summary import Summary
from core.scenario.write import scenario_toml
from flexgui import __version__
from flexgui.export.folder import swap_in, work_folder
from flexgui.export.plot import Plot, packed_plotly, plot
from flexgui.export.strict_json import dumps
from flexgui.export.study_tables import study_frames
from flexgui.views.study_advice import (
    bias_figure,
    bias_table,
    candidate_table,
    length_table,
    planning_figure,
    predicted_table,
)
from flexgui.views.study_estimates import (
    deviation_table,
    explained_table,
    parameter_table,
    stiffness_table,
    study_valley,
)
from flexgui.views.study_methods import (
    baseline_figure,
    baseline_table,
    conclusion_table,
    pole_figure,
    sweep_fits,
    sweep_path,
    sweep_table,
)
from flexgui.views.table import Table

REPORT = "study.html"
RESULT = "result.json"


@dataclass(frozen=True)
class Section:
    """A heading with figures and tables under it."""

    id: str
    title: str
    figures: tuple[Plot, ...]
    tables: tuple[tuple[str, Table], ...]
    """(heading, table)"""


def write_study(summary: Summary, out: Path) -> None:
    """Page, tables and result into `out`, all of them or none."""
    try:
        with work_folder(out) as room:
            files = _write(summary, room)
            result = dumps({**study_result(summary), "files": [*files, RESULT]})
            (room / RESULT).write_text(result, encoding="utf-8")
            swap_in(room, out)
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"The output folder {out} cannot be written: {reason}.") from error


def _write(summary: Summary, room: Path) -> list[str]:
    files = [REPORT, "scenario.toml"]
    (room / REPORT).write_text(study_html(summary), encoding="utf-8")
    text = scenario_toml(summary.settings.scenario)
    (room / "scenario.toml").write_text(text, encoding="utf-8")
    for name, frame in study_frames(summary).items():
        frame.to_csv(room / f"{name}.csv", index=False)
        files.append(f"{name}.csv")
    return files


def study_result(summary: Summary) -> dict[str, object]:
    """What a script may want to know first."""
    settings = summary.settings.model_dump(exclude={"scenario"})
    checked = summary.validation
    return {
        "schema": 1,
        "title": summary.title,
        "study": summary.settings.identity,
        "settings": settings,
        "true_EI": summary.true_EI,
        "findings": [{"heading": h, "text": t} for h, t in summary.findings],
        "sweep_fit_percent": {k: checked.mean(k) for k in checked.fits} if checked else {},
    }


def study_html(summary: Summary) -> str:
    """The whole page as text."""
    template = _environment().get_template("study.html.j2")
    return template.render(
        plotly=packed_plotly(),
        version=__version__,
        title=summary.title,
        findings=summary.findings,
        sections=tuple(sections(summary)),
        scenario_text=scenario_toml(summary.settings.scenario),
    )


@cache
def _environment() -> Environment:
    return Environment(
        loader=PackageLoader("flexgui.export"), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip


def sections(s: Summary) -> Iterator[Section]:
    """As many as there are results for."""
    if s.tables:
        yield _section(
            "estimates",
            "Estimates",
            [study_valley(s.tables, s.prior, s.true_EI)],
            [
                ("Tables I and II", parameter_table(s.tables)),
                ("The same in EI", stiffness_table(s.tables, s.stiffness)),
                ("Deviation of the mean of the local estimates", deviation_table(s.tables)),
            ],
        )
    clean = next((t for t in s.tables if t.snr_db is None and t.runs > 1), None)
    if clean is not None and s.prior is not None:
        table = ("Deviations along the valley", explained_table(clean, s.prior))
        yield _section("prior", "What prior and search explain", [], [table])
    if s.tables and s.bias:
        yield _section(
            "bias",
            "Bias in EI",
            [bias_figure(s.tables, s.bias, s.true_EI)],
            [("Sources", bias_table(s.bias, s.settings.points))],
        )
    if s.validation is not None:
        v = s.validation
        table = ("FIT", sweep_table(v))
        yield _section("sweeps", "Validation sweeps", [sweep_path(v), sweep_fits(v)], [table])
    yield from _later_sections(s)


def _later_sections(s: Summary) -> Iterator[Section]:
    if s.baselines:
        low, high = min(s.settings.points), max(s.settings.points)
        middle = sorted({r.points for r in s.baselines})
        points = len(s.settings.points) if len(s.settings.points) in middle else middle[-1]
        figures = [baseline_figure(s.baselines), pole_figure(s.baselines, points, low, high)]
        tables = [
            ("All rows", baseline_table(s.baselines)),
            ("What each row says", conclusion_table(s.baselines)),
        ]
        yield _section("baselines", "Baselines", figures, tables)
    if s.planning is not None:
        tables = [
            ("The best experiments", candidate_table(s.planning)),
            ("Length", length_table(s.planning)),
            ("Predicted and found", predicted_table(s.planning)),
        ]
        yield _section("advice", "Experiment advice", [planning_figure(s.planning)], tables)


def _section(id: str, title: str, figures: list, tables: list[tuple[str, Table]]) -> Section:
    drawn = tuple(p for f in figures if (p := plot(f)) is not None)
    return Section(id, title, drawn, tuple(tables))
