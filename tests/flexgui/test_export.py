"""What lies in the folder after an export, and what stays there after a failed one."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import loadmat

from flexgui import __version__
from flexgui.core.errors import InputError
from flexgui.core.results import Equation, Outcome
from flexgui.export import export_files
from flexgui.export.export_files import export_outcome
from flexgui.export.folder import check_writable, dumps, swap_in
from flexgui.export.tables import unique_slugs
from tests.approved import approved
from tests.export.helpers import outlined, readable

Exported = Callable[[str], Path]
LARGEST_REPORT = 1.5e6
"""Bytes, without a motion: half a million are plotly.js."""
CSV_ROUNDING = 1e-9
"""Relative: tables hold ten digits."""


def read_result(out: Path) -> dict:
    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is no JSON")

    return json.loads((out / "result.json").read_text("utf-8"), parse_constant=refuse)


def contents(out: Path) -> dict[str, bytes]:
    return {p.relative_to(out).as_posix(): p.read_bytes() for p in out.rglob("*") if p.is_file()}


def test_all_files_are_there_and_listed(exported: Exported) -> None:
    there = contents(exported("glocal"))
    assert sorted(there) == read_result(exported("glocal"))["files"]
    assert {"report.html", "result.json", "model.mat", "model.json", "scenario.toml",
            "tables/parameters.csv", "tables/fit.csv", "tables/correlation.csv",
            "tables/convergence.csv", "tables/recording_th1.csv"} <= set(there)  # fmt: skip
    assert {"model_control.py", "model.fmu", "model_c/flexmodel.c", "model_c/flexmodel.h",
            "arm_c/flexarm.c", "arm_c/flexarm.h"} <= set(there)  # fmt: skip
    assert "# θ2, <b>" in there["scenario.toml"].decode()


def rounded(path: Path) -> str:
    """The first rows of a table."""
    table = pd.read_csv(path)
    rows = table.head(3).to_csv(index=False, float_format="%.4g")
    return f"## {path.name}, {len(table)} rows\n{rows}"


@pytest.mark.parametrize("name", ["glocal", "local", "bare", "diagnosed"])
def test_report_result_and_tables_are_as_approved(name: str, exported: Exported) -> None:
    out = exported(name)
    report = readable((out / "report.html").read_text("utf-8"))
    report = re.sub(r"SHA-256 \w+", "SHA-256 ...", report.replace(__version__, "..."))
    approved(f"export/{name}/report.txt", report)
    result = json.dumps(outlined(read_result(out)), indent=1, ensure_ascii=False)
    approved(f"export/{name}/result.json", result + "\n")
    tables = [rounded(path) for path in sorted((out / "tables").iterdir())]
    approved(f"export/{name}/tables.csv", "\n".join(tables))


def test_strict_json_knows_numpy_and_refuses_nothing_finite() -> None:
    value = {"a": np.float64("nan"), "b": np.array([1.0, np.inf]), "c": (np.int64(3), True)}
    assert json.loads(dumps(value)) == {"a": None, "b": [1.0, None], "c": [3, True]}


def test_the_mat_file_gives_back_the_descriptor_model(exported: Exported, glocal: Outcome) -> None:
    mat, model = loadmat(exported("glocal") / "model.mat"), glocal.model
    theta2 = 0.7
    basis = [1.0, np.cos(theta2)]
    expected = sum(f * term for f, term in zip(basis, model.E_terms, strict=True))
    np.testing.assert_array_equal(mat["E0"] + np.cos(theta2) * mat["E1"], expected)
    np.testing.assert_array_equal(mat["A0"], model.A_terms[0])
    for name in "BCD":
        np.testing.assert_array_equal(mat[name], getattr(model, name))
    assert [str(cell[0][0]) for cell in mat["E_basis"]] == list(model.basis)
    assert [str(cell[0][0]) for cell in mat["states"]] == list(model.states)
    assert "E = E0 + cos(theta2)*E1; A = A0; sys = dss(A, B, C, D, E);" in str(mat["note"][0])


def test_the_json_model_equals_the_mat_model(exported: Exported, glocal: Outcome) -> None:
    model = json.loads((exported("glocal") / "model.json").read_text("utf-8"))
    np.testing.assert_array_equal(model["E_terms"], glocal.model.E_terms)
    assert tuple(model["inputs"]) == glocal.model.inputs


def test_tables_hold_every_sample(exported: Exported, glocal: Outcome) -> None:
    table = pd.read_csv(exported("glocal") / "tables" / "recording_th1.csv")
    channel = glocal.comparisons[0].channels[2]
    assert len(table) == channel.time.size
    np.testing.assert_allclose(table["t [s]"], channel.time, rtol=CSV_ROUNDING)
    np.testing.assert_allclose(table["z1 measured [m]"], channel.measured, rtol=CSV_ROUNDING)
    np.testing.assert_array_equal(table["z1 counted"], channel.counted)


class Page(HTMLParser):
    """Collects what a browser would fetch, run and show."""

    def __init__(self) -> None:
        super().__init__()
        self.links: list[str] = []
        self.scripts = 0

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.links += [given[k] or "" for k in ("src", "href", "srcset", "data") if k in given]
        self.scripts += tag == "script"


def page(out: Path) -> tuple[str, Page]:
    text = (out / "report.html").read_text("utf-8")
    parsed = Page()
    parsed.feed(text)
    return text, parsed


def test_the_report_fetches_nothing(exported: Exported) -> None:
    text, parsed = page(exported("glocal"))
    assert parsed.links == []
    assert "default-src 'none'" in text
    assert "@import" not in text.split("<script")[0]
    assert len(text) < LARGEST_REPORT


def test_names_are_text_and_never_markup(
    glocal: Outcome, exported: Exported, tmp_path: Path
) -> None:
    name = """<script>alert(1)</script></script><b>a & b"; x"""
    first, *rest = glocal.comparisons
    renamed = replace(
        glocal, title=name, comparisons=(replace(first, recording=name, note=name), *rest),
        notes=(name,), equations=(Equation(name, rf"\text{{{name}}}"),),
    )  # fmt: skip
    export_outcome(renamed, name, tmp_path)
    text, parsed = page(tmp_path)
    assert parsed.scripts == page(exported("glocal"))[1].scripts
    assert "<script>alert" not in text
    assert "<b>" not in text.split("<script>")[0]
    tables = {p.name for p in (tmp_path / "tables").iterdir()}
    assert len([t for t in tables if t.startswith("recording_")]) == 7


def test_file_names_are_safe_and_unique() -> None:
    slugs = unique_slugs(["a/b", "a b", "A_B", "../../etc", "", "ä", "x" * 500])
    assert len({slug.lower() for slug in slugs}) == 7
    assert all("/" not in s and not s.startswith(".") and 0 < len(s) <= 90 for s in slugs)


def test_a_second_export_replaces_the_first(bare: Outcome, local: Outcome, tmp_path: Path) -> None:
    export_outcome(local, "", tmp_path)
    (tmp_path / "tables" / "mine.csv").write_text("kept")
    export_outcome(bare, "", tmp_path)
    assert sorted(contents(tmp_path)) == sorted([*read_result(tmp_path)["files"],
                                                 "tables/mine.csv"])  # fmt: skip
    assert not (tmp_path / "tables" / "recording_th1.csv").exists()


@pytest.mark.parametrize("calls", [None, 0, 1, 4])
def test_a_failure_while_writing_or_swapping_leaves_the_old_files(
    calls: int | None, bare: Outcome, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    export_outcome(bare, "", tmp_path)
    before = contents(tmp_path)
    replace, count = Path.replace, 0

    def full(*_: object) -> str:
        raise OSError(28, "No space left on device")

    def failing(self: Path, target: Path) -> Path:
        nonlocal count
        count += 1
        if calls is not None and count > calls:
            raise PermissionError(13, "Permission denied")
        return replace(self, target)

    if calls is None:
        monkeypatch.setattr(export_files, "report_html", full)
    monkeypatch.setattr(Path, "replace", failing)
    with pytest.raises(InputError, match="unchanged") as said:
        export_outcome(bare, "other", tmp_path)
    assert calls is not None or "no space left on device" in str(said.value)
    assert contents(tmp_path) == before


def test_an_interrupt_while_writing_leaves_no_trace(
    bare: Outcome, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object) -> str:
        raise KeyboardInterrupt

    monkeypatch.setattr(export_files, "report_html", interrupted)
    with pytest.raises(KeyboardInterrupt):
        export_outcome(bare, "", tmp_path / "new")
    assert list(tmp_path.iterdir()) == []


def test_an_index_that_lists_files_elsewhere_removes_nothing_there(
    bare: Outcome, tmp_path: Path
) -> None:
    outside = tmp_path / "outside.txt"
    outside.write_text("mine")
    out = tmp_path / "out"
    out.mkdir()
    names = ["../outside.txt", str(outside)]
    (out / "result.json").write_text(json.dumps({"files": names}))
    export_outcome(bare, "", out)
    assert outside.read_text() == "mine"


def test_a_file_in_the_way_is_refused_before_the_work(tmp_path: Path) -> None:
    file = tmp_path / "report"
    file.write_text("mine")
    for out in (file, file / "below"):
        with pytest.raises(InputError, match="--out"):
            check_writable(out)
    assert file.read_text() == "mine"


def test_checking_leaves_no_trace(tmp_path: Path) -> None:
    check_writable(tmp_path / "a" / "b")
    assert list(tmp_path.iterdir()) == []


def test_a_folder_in_the_way_of_a_file_is_one_sentence(bare: Outcome, tmp_path: Path) -> None:
    (tmp_path / "report.html").mkdir()
    with pytest.raises(InputError, match="report.html"):
        export_outcome(bare, "", tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]


def test_swapping_works_outside_the_main_thread(tmp_path: Path) -> None:
    from threading import Thread

    room, out = tmp_path / "room", tmp_path / "out"
    room.mkdir()
    out.mkdir()
    (room / "a").write_text("1")
    worker = Thread(target=swap_in, args=(room, out))
    worker.start()
    worker.join()
    assert (out / "a").read_text() == "1"
