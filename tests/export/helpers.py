"""Models whose exports are run, outcomes of them without a run, and what a report's figures say."""

from __future__ import annotations

import base64
import ctypes
import gzip
import subprocess
from collections.abc import Mapping
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flexgui.core.drives import build_drive
from flexgui.core.drives.torque import Torque
from flexgui.core.model import Model
from flexgui.core.results import Outcome
from flexgui.core.simulate.descriptor import descriptor
from flexgui.core.simulate.mechanism import mechanism
from flexgui.core.simulate.state_equations import state_equations
from flexgui.export.formats.fmu import compiler
from tests.helpers import ARMS, loaded, looped


def outcome_of(model: Model, title: str = "A test") -> Outcome:
    """What an export of this model is made from."""
    values = dict(model.effect_values)
    return Outcome(
        title, "glocal", "lpv", (), (), descriptor(model, model.numbers(values)), (),
        mechanism=mechanism(model, values), state_equations=state_equations(model, values),
    )  # fmt: skip


def inputs(samples: int, count: int, seed: int = 5) -> np.ndarray:
    """(samples, count) random steps, held ten samples each."""
    rng = np.random.default_rng(seed)
    steps = rng.choice([-0.3, 0.3], (samples // 10 + 1, count))
    return np.repeat(steps, 10, axis=0)[:samples]


def figure_text(page: str) -> str:
    """JSON of all figures of a report, as its script unpacks it."""
    packed = page.split('id="figures">')[1].split("<")[0]
    content = gzip.decompress(base64.b64decode(packed))
    return content[4 : 4 + int.from_bytes(content[:4], "little")].decode()


STRICT = ("-std=c99", "-O2", "-Wall", "-Wextra", "-pedantic", "-Werror", "-ffp-contract=off")
needs_compiler = pytest.mark.skipif(
    compiler() is None, reason="there is no C compiler (cc, gcc or clang) on this machine"
)


def shared_object(sources: Mapping[str, str], room: Path) -> ctypes.CDLL:
    """Sources, compiled and loaded; any warning is an error."""
    for name, text in sources.items():
        (room / name).write_text(text, encoding="utf-8")
    files = [name for name in sources if name.endswith(".c")]
    order = [str(compiler()), *STRICT, "-shared", "-fPIC", "-o", "made.so", *files, "-lm"]
    subprocess.run(order, cwd=room, check=True)
    return ctypes.CDLL(str(room / "made.so"))


def doubles(values: np.ndarray) -> Any:
    """A pointer to them; to the array itself, where it already is one of doubles in a row."""
    return np.ascontiguousarray(values, float).ctypes.data_as(ctypes.POINTER(ctypes.c_double))


GRAVITY = (1.5, -9.81)

FEEDBACK = build_drive(
    "state_feedback",
    {
        "gains": [[50.0, 8.0, 3.0, 0.5], [30.0, 5.0, 2.0, 0.2]],
        "torque_constants": [1.5, 0.8],
        "rate_filter": 300.0,
    },
)

MODELS: dict[str, Model] = {
    **{f"loop {name}": looped(loaded(ARMS[name]), 20.0, "lpv") for name in
       ("1-1", "2-2", "3-3", "slide", "ground", "0-2-1")},
    "loop under gravity": looped(loaded(ARMS["2-2"], GRAVITY), level="lpv"),
    "states of a drive": Model(loaded(ARMS["1-1"]), FEEDBACK, "lpv"),
    "torque": Model(loaded(ARMS["2-2"]), Torque(), "lpv"),
}  # fmt: skip


class _Text(HTMLParser):
    """A line for each heading, paragraph, row and figure; formulas and scripts are left out."""

    LINES = frozenset("h1 h2 h3 h4 p tr li figcaption caption summary dt dd div pre".split())
    SILENT = frozenset("script style math svg title".split())

    def __init__(self) -> None:
        super().__init__()
        self.lines, self.silent = [""], 0

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.silent += tag in self.SILENT
        label = dict(attrs).get("aria-label")
        if tag in self.LINES:
            self.lines.append(f"{'#' * int(tag[1])} " if tag[0] == "h" else "")
        if tag == "math":
            self.lines[-1] += "[formula]"
        if tag in ("td", "th") and self.lines[-1]:
            self.lines[-1] += " | "
        if label:
            self.lines.append(f"[figure] {label}")

    def handle_endtag(self, tag: str) -> None:
        self.silent -= tag in self.SILENT
        if tag in self.LINES:
            self.lines.append("")

    def handle_data(self, data: str) -> None:
        self.lines[-1] += "" if self.silent else data


def readable(page: str) -> str:
    """What a person reads in a page, a line per paragraph or row of a table."""
    parsed = _Text()
    parsed.feed(page)
    lines = (" ".join(line.split()) for line in parsed.lines)
    return "\n".join(line for line in lines if line.strip("| ")) + "\n"


def outlined(value: Any) -> Any:
    """A document with four digits of each number and the first two entries of each long list."""
    if isinstance(value, dict):
        return {key: outlined(entry) for key, entry in value.items()}
    if isinstance(value, list):
        few = [outlined(entry) for entry in value[: 2 if len(value) > 4 else None]]
        return few if len(few) == len(value) else [*few, f"... {len(value)} in all"]
    return float(f"{value:.4g}") if isinstance(value, float) else value
