"""The report of a study: one page that works without a network, and its tables."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from flexgui import __version__
from flexgui.core.errors import InputError
from flexgui.core.montecarlo.estimates import agreements, comparable, explained, pooled
from flexgui.core.montecarlo.summary import LEVELS, Summary
from flexgui.core.scenario.read import scenario_toml
from flexgui.export.folder import dumps, swap_in, work_folder
from flexgui.export.report import environment
from flexgui.export.report_plot import Plot, packed_plotly, plot
from flexgui.stages.study.baselines import conclusions, result_words
from flexgui.stages.study.findings import findings
from flexgui.stages.study.plots_estimates import (
    deviation_table,
    explained_table,
    parameter_table,
    stiffness_table,
    study_valley,
)
from flexgui.stages.study.plots_methods import (
    baseline_figure,
    baseline_table,
    bias_figure,
    bias_table,
    candidate_table,
    conclusion_table,
    length_table,
    planning_figure,
    pole_figure,
    predicted_table,
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
        with work_folder(out) as folder:
            files = _write(summary, folder)
            result = dumps({**study_result(summary), "files": [*files, RESULT]})
            (folder / RESULT).write_text(result, encoding="utf-8")
            swap_in(folder, out)
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"The output folder {out} cannot be written: {reason}.") from error


def _write(summary: Summary, folder: Path) -> list[str]:
    files = [REPORT, "scenario.toml"]
    (folder / REPORT).write_text(study_html(summary), encoding="utf-8")
    text = scenario_toml(summary.settings.scenario)
    (folder / "scenario.toml").write_text(text, encoding="utf-8")
    for name, frame in study_frames(summary).items():
        frame.to_csv(folder / f"{name}.csv", index=False)
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
        "findings": [{"heading": h, "text": t} for h, t in findings(summary)],
        "sweep_fit_percent": {k: checked.mean(k) for k in checked.fits} if checked else {},
    }


def study_html(summary: Summary) -> str:
    """The whole page as text."""
    template = environment().get_template("study.html.j2")
    return template.render(
        plotly=packed_plotly(),
        version=__version__,
        title=summary.title,
        findings=tuple(findings(summary)),
        sections=tuple(sections(summary)),
        scenario_text=scenario_toml(summary.settings.scenario),
    )


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


Frames = dict[str, pd.DataFrame]

TIMES = "baseline_times"
"""The one table that no two runs of a study share to the last digit."""


def study_frames(summary: Summary) -> Frames:
    """File name (without '.csv') -> table; a part that is not finished has none."""
    named: dict[str, Callable[[Summary], pd.DataFrame]] = {
        "estimates": _estimates,
        "runs": _runs,
        "deviation_of_mean": _deviations,
        "beside_the_paper": _beside,
        "valley": _valley,
        "sweeps": _sweeps,
        "baselines": _baselines,
        TIMES: _times,
        "bias": _bias,
        "candidates": _candidates,
        "predicted": _predicted,
    }
    made = {name: make(summary) for name, make in named.items()}
    return {name: frame for name, frame in made.items() if len(frame)}


def _ratio(snr_db: float | None) -> float:
    return float("inf") if snr_db is None else snr_db


def _estimates(s: Summary) -> pd.DataFrame:
    rows = []
    for table in s.tables:
        published = comparable(table)
        for k, row in enumerate(table.rows):
            found: dict[str, object] = {
                "snr_db": _ratio(table.snr_db), "fit": row.label, "theta2": row.theta2,
                "runs": table.runs,
            }  # fmt: skip
            for name, value in row.values.items():
                found |= {f"{name}_mean": value.mean, f"{name}_std": value.std}
            for i, EI in enumerate(row.EI):
                suffix = "" if len(row.EI) == 1 else str(i + 1)
                found |= {f"EI{suffix}_mean": EI.mean, f"EI{suffix}_std": EI.std}
            found["EI_of_means"] = row.EI_of_means
            if published is not None:
                names = ("epsilon_GPa", "epsilon_std_GPa", "d_mm", "d_std_mm")
                found |= {f"paper_{n}": v for n, v in zip(names, published[k], strict=True)}
            rows.append(found)
    return pd.DataFrame(rows)


def _runs(s: Summary) -> pd.DataFrame:
    rows = [
        {"snr_db": _ratio(table.snr_db), "fit": row.label, "run": k + 1, **pair}
        for table in s.tables
        for row in table.rows
        for k, pair in enumerate(row.pairs)
    ]
    return pd.DataFrame(rows)


def _deviations(s: Summary) -> pd.DataFrame:
    rows = [
        (_ratio(t.snr_db), d.name, d.of_mean, d.caption, d.found)
        for t in s.tables
        for d in t.deviations
    ]
    return pd.DataFrame(rows, columns="snr_db quantity of_mean caption found".split())


def _beside(s: Summary) -> pd.DataFrame:
    rows = [
        (_ratio(a.snr_db), a.label, a.name, a.ours, a.paper, a.deviation, a.within)
        for a in agreements(s.tables)
    ]
    names = "snr_db fit quantity here paper paper_std within"
    return pd.DataFrame(rows, columns=names.split())


def _valley(s: Summary) -> pd.DataFrame:
    clean = next((t for t in s.tables if t.snr_db is None), None)
    if clean is None or s.prior is None:
        return pd.DataFrame()
    rows = [
        (e.label, e.name, e.found, e.expected, e.ratio, s.prior.flat[e.name].std)
        for e in (*explained(clean, s.prior), *pooled(clean, s.prior))
    ]
    names = "fit quantity found prior_and_search ratio uniform_prior"
    return pd.DataFrame(rows, columns=names.split())


def _sweeps(s: Summary) -> pd.DataFrame:
    if s.validation is None:
        return pd.DataFrame()
    frame = pd.DataFrame({"sweep": s.validation.sweeps})
    for level in LEVELS:
        for k in range(2):
            frame[f"{level}_fit{k + 1}_percent"] = s.validation.fits[level][:, k]
    return frame


def _baselines(s: Summary) -> pd.DataFrame:
    rows = [
        {
            "points": r.points, "snr_db": _ratio(r.snr_db), "method": r.method,
            **{f"fit_{kind}_percent": value for kind, value in r.fit.items()},
            "pole_error": r.pole_error, "parameters": r.parameters, "result": result_words(r),
        }
        for r in s.baselines
    ]  # fmt: skip
    return pd.DataFrame(rows)


def _times(s: Summary) -> pd.DataFrame:
    rows = [
        (r.points, _ratio(r.snr_db), r.method, r.seconds, conclusion)
        for r, conclusion in zip(s.baselines, conclusions(s.baselines), strict=True)
    ]
    return pd.DataFrame(rows, columns="points snr_db method seconds conclusion".split())


def _bias(s: Summary) -> pd.DataFrame:
    rows = []
    for source in s.bias:
        for draw in range(len(source.local)):
            each = {f"local_{k + 1}": v for k, v in enumerate(source.local[draw])}
            rows.append(
                {
                    "excitation": source.excitation, "rates": source.rates, "draw": draw + 1,
                    **each, "glocal": source.glocal[draw],
                }
            )  # fmt: skip
    return pd.DataFrame(rows)


def _candidates(s: Summary) -> pd.DataFrame:
    if s.planning is None:
        return pd.DataFrame()
    rows = []
    for c in s.planning.candidates:
        found: dict[str, object] = {
            "experiment": c.experiment.name, "theta2": c.experiment.theta2,
            "seconds": c.experiment.seconds, "chosen": c in s.planning.chosen,
        }  # fmt: skip
        for e in c.expected:
            found |= {f"{e.target}_std": e.std, f"{e.target}_bias": e.bias}
        rows.append(found)
    return pd.DataFrame(rows)


def _predicted(s: Summary) -> pd.DataFrame:
    if s.planning is None:
        return pd.DataFrame()
    rows = [(p.label, p.target, p.predicted, p.found) for p in s.planning.predicted]
    return pd.DataFrame(rows, columns="fit target predicted found".split())
