"""The report of a study: one page that works without a network, and its tables."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from flexgui import __version__
from flexgui.core.errors import InputError
from flexgui.core.montecarlo.estimates import (
    Agreement,
    EstimateTable,
    agreements,
    comparable,
    explained,
    pooled,
)
from flexgui.core.montecarlo.summary import LEVELS, BaselineRow, Summary
from flexgui.core.scenario.read import scenario_toml
from flexgui.export.figures import Figures
from flexgui.export.folder import dumps, swap_in, work_folder
from flexgui.export.template import environment
from flexgui.stages.study.findings import conclusions, findings, result_text
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
from flexgui.views.layout import Figure
from flexgui.views.table import Table

REPORT = "study.html"
RESULT = "result.json"


@dataclass(frozen=True)
class Section:
    """A heading with figures and tables under it."""

    id: str
    title: str
    figures: tuple[Figure, ...]
    tables: tuple[tuple[str, Table], ...]
    """(heading, table)"""


def write_study(summary: Summary, out: Path) -> None:
    """Page, tables and result into `out`, all of them or none (InputError)."""
    try:
        with work_folder(out) as folder:
            files = _write(summary, folder)
            result = dumps({**study_result(summary), "files": [*files, RESULT]})
            (folder / RESULT).write_text(result, encoding="utf-8")
            swap_in(folder, out)
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"The output folder {out} cannot be written: {reason}.") from None


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
        figures=Figures(),
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
            "estimates", "Estimates", [study_valley(s.tables, s.prior, s.true_EI)],
            {
                "Tables I and II": parameter_table(s.tables),
                "The same in EI": stiffness_table(s.tables, s.stiffness),
                "Deviation of the mean of the local estimates": deviation_table(s.tables),
            },
        )  # fmt: skip
    clean = next((t for t in s.tables if t.snr_db is None and t.runs > 1), None)
    if clean is not None and s.prior is not None:
        tables = {"Deviations along the valley": explained_table(clean, s.prior)}
        yield _section("prior", "What prior and search explain", [], tables)
    if s.tables and s.bias:
        figures = [bias_figure(s.tables, s.bias, s.true_EI)]
        tables = {"Sources": bias_table(s.bias, s.settings.points)}
        yield _section("bias", "Bias in EI", figures, tables)
    if (v := s.validation) is not None:
        tables = {"FIT": sweep_table(v)}
        yield _section("sweeps", "Validation sweeps", [sweep_path(v), sweep_fits(v)], tables)
    if s.baselines:
        low, high = min(s.settings.points), max(s.settings.points)
        numbers = {r.points for r in s.baselines}
        points = len(s.settings.points) if len(s.settings.points) in numbers else max(numbers)
        figures = [baseline_figure(s.baselines), pole_figure(s.baselines, points, low, high)]
        tables = {
            "All rows": baseline_table(s.baselines),
            "What each row says": conclusion_table(s.baselines),
        }
        yield _section("baselines", "Baselines", figures, tables)
    if s.planning is not None:
        tables = {
            "The best experiments": candidate_table(s.planning),
            "Length": length_table(s.planning),
            "Predicted and found": predicted_table(s.planning),
        }
        yield _section("advice", "Experiment advice", [planning_figure(s.planning)], tables)


def _section(
    id: str, title: str, figures: list[Figure | None], tables: dict[str, Table]
) -> Section:
    drawn = tuple(figure for figure in figures if figure is not None)
    return Section(id, title, drawn, tuple(tables.items()))


TIMES = "baseline_times"
"""The one table that no two runs of a study share to the last digit."""

Rows = Iterator[dict[str, object]]
"""Of a table: name of each column -> value."""


def study_frames(summary: Summary) -> dict[str, pd.DataFrame]:
    """File name (without '.csv') -> table; a part that is not finished has none."""
    named: dict[str, Callable[[Summary], Rows]] = {
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
    made = {name: pd.DataFrame(rows(summary)) for name, rows in named.items()}
    return {name: frame for name, frame in made.items() if len(frame)}


def _ratio(of: EstimateTable | BaselineRow | Agreement) -> dict[str, object]:
    return {"snr_db": float("inf") if of.snr_db is None else of.snr_db}


def _fields(of: object, **columns: str) -> dict[str, object]:
    """Column -> attribute of a result."""
    return {column: getattr(of, name) for column, name in columns.items()}


def _estimates(s: Summary) -> Rows:
    for table in s.tables:
        published = comparable(table)
        for k, row in enumerate(table.rows):
            fit = {"fit": row.label, "theta2": row.theta2, "runs": table.runs}
            spread = dict(row.values)
            suffixes = [""] if len(row.EI) == 1 else [str(i + 1) for i in range(len(row.EI))]
            spread |= {f"EI{suffix}": EI for suffix, EI in zip(suffixes, row.EI, strict=True)}
            columns: dict[str, object] = _ratio(table) | fit
            for name, value in spread.items():
                columns |= {f"{name}_mean": value.mean, f"{name}_std": value.std}
            columns["EI_of_means"] = row.EI_of_means
            if published is not None:
                names = ("epsilon_GPa", "epsilon_std_GPa", "d_mm", "d_std_mm")
                columns |= {f"paper_{n}": v for n, v in zip(names, published[k], strict=True)}
            yield columns


def _runs(s: Summary) -> Rows:
    for table in s.tables:
        for row in table.rows:
            for k, pair in enumerate(row.pairs, start=1):
                yield _ratio(table) | {"fit": row.label, "run": k, **pair}


def _deviations(s: Summary) -> Rows:
    columns = {"quantity": "name", "of_mean": "of_mean", "caption": "caption", "found": "found"}
    return (_ratio(t) | _fields(d, **columns) for t in s.tables for d in t.deviations)


def _beside(s: Summary) -> Rows:
    columns = {
        "fit": "label", "quantity": "name", "here": "ours", "paper": "paper",
        "paper_std": "deviation", "within": "within",
    }  # fmt: skip
    return (_ratio(a) | _fields(a, **columns) for a in agreements(s.tables))


def _valley(s: Summary) -> Rows:
    clean = next((t for t in s.tables if t.snr_db is None), None)
    if clean is None or s.prior is None:
        return
    columns = {
        "fit": "label", "quantity": "name", "found": "found", "prior_and_search": "expected",
        "ratio": "ratio",
    }  # fmt: skip
    for e in (*explained(clean, s.prior), *pooled(clean, s.prior)):
        yield _fields(e, **columns) | {"uniform_prior": s.prior.flat[e.name].std}


def _sweeps(s: Summary) -> Rows:
    if (v := s.validation) is None:
        return
    for row, number in enumerate(v.sweeps):
        fits = {f"{n}_fit{k + 1}_percent": v.fits[n][row, k] for n in LEVELS for k in range(2)}
        yield {"sweep": number, **fits}


def _baselines(s: Summary) -> Rows:
    for r in s.baselines:
        fits = {f"fit_{kind}_percent": value for kind, value in r.fit.items()}
        own = {"pole_error": r.pole_error, "parameters": r.parameters, "result": result_text(r)}
        yield {"points": r.points, **_ratio(r), "method": r.method, **fits, **own}


def _times(s: Summary) -> Rows:
    for r, conclusion in zip(s.baselines, conclusions(s.baselines), strict=True):
        took = {"method": r.method, "seconds": r.seconds, "conclusion": conclusion}
        yield {"points": r.points, **_ratio(r), **took}


def _bias(s: Summary) -> Rows:
    for source in s.bias:
        which = {"excitation": source.excitation, "rates": source.rates}
        draws = zip(source.local, source.glocal, strict=True)
        for draw, (local, glocal) in enumerate(draws, start=1):
            each = {f"local_{k}": v for k, v in enumerate(local, start=1)}
            yield {**which, "draw": draw, **each, "glocal": glocal}


def _candidates(s: Summary) -> Rows:
    if s.planning is None:
        return
    for c in s.planning.candidates:
        columns = {"experiment": "name", "theta2": "theta2", "seconds": "seconds"}
        row = _fields(c.experiment, **columns) | {"chosen": c in s.planning.chosen}
        for e in c.expected:
            row |= {f"{e.target}_std": e.std, f"{e.target}_bias": e.bias}
        yield row


def _predicted(s: Summary) -> Rows:
    columns = {"fit": "label", "target": "target", "predicted": "predicted", "found": "found"}
    return (_fields(p, **columns) for p in (s.planning.predicted if s.planning else ()))
