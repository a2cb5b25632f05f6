"""Bad input of every kind, generated from fixed seeds."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO

import numpy as np
from scipy.io import savemat

from tests.cli.helpers import COLUMNS, FILE, SCENARIO, TEXT, Case, csv, swapped, table


def rng(seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)


def of_table(label: str, lines: list[list[str]], *words: str, text: str = TEXT) -> Case:
    return Case(label, (FILE, *words), text, {FILE: csv(lines)})


def missing_scenarios() -> Iterator[Case]:
    for name in ("gone.toml", "no/such/place.toml", "case", "two words.toml", "Case.TOML"):
        yield Case(f"scenario {name}", (name, "does not exist"), scenario=name)


def wrong_toml() -> Iterator[Case]:
    garbage = (
        "= 3",
        "[arm",
        "x = ",
        'y = "abc',
        "title title",
        "[[recordings]",
        "a = [1, 2",
        "é = 1",
    )
    lines = TEXT.splitlines()
    for k, bad in enumerate(garbage):
        at = int(rng(k).integers(1, len(lines)))
        text = "\n".join([*lines[:at], bad, *lines[at:]])
        yield Case(f"toml {k} {bad} at {at}", (SCENARIO, "not valid TOML"), text)
    yield Case(
        "toml of a key given twice", (SCENARIO, "not valid TOML"), TEXT + "max_effects = 1\n"
    )


def bad_tables() -> Iterator[Case]:
    """One of each kind; those who read files have the others."""
    lines = table()
    lines[40][COLUMNS.index("theta1")] = "abc"
    yield of_table("a cell", lines, "theta1", "row 40")
    lines = table()
    lines[87][COLUMNS.index("dtheta2_ref")] = "1e15"
    yield Case("the largest number that is read", ("far too large",), files={FILE: csv(lines)})
    lines = table()
    lines[50][0] = f"{float(lines[50][0]) - 0.0035:.6f}"
    yield of_table("a time that falls back", lines, "column t", "row")
    lines = table()
    lines[0][COLUMNS.index("theta1")] = "theta1 [N m]"
    yield of_table("a unit", lines, "theta1 [N m]")
    for name in ("t", "dtheta1_ref", "theta1", "z2"):
        lines = table()
        lines[0][COLUMNS.index(name)] = f"my_{name}"
        yield of_table(f"no column {name}", lines, f"no column {name}")


def wrong_arrays() -> dict[str, dict[str, np.ndarray]]:
    """Variables of a MAT file that are no columns of one table."""
    columns = np.array(table()[1:], dtype=float).T
    whole = dict(zip(COLUMNS, columns, strict=True))
    return {
        "a matrix": {**whole, "theta1": np.outer(columns[3], np.ones(3))},
        "unequal lengths": {**whole, "theta2": columns[4][:50]},
        "texts": {**whole, "dtheta1_ref": np.array(["a", "b"])},
        "nothing of use": {"x": columns[1], "y": columns[2]},
        "no number": {**whole, "theta1": np.where(columns[0] == 0.01, np.nan, columns[3])},
        "complex numbers": {**whole, "dtheta2_ref": columns[2] + 1j},
    }


def mat(arrays: dict[str, np.ndarray]) -> bytes:
    buffer = BytesIO()
    savemat(buffer, arrays)
    return buffer.getvalue()


def bad_files() -> Iterator[Case]:
    whole = csv(table())
    contents: dict[str, str | bytes] = {
        "empty": "", "blank": "\n\n\n", "header": whole.splitlines()[0] + "\n",
        "one row": "\n".join(whole.splitlines()[:2]) + "\n",
        "nine rows": "\n".join(whole.splitlines()[:10]) + "\n",
        "zeros": b"\0" * 200, "html": "<html><body>404</body></html>",
        "no header": "\n".join(whole.splitlines()[1:]) + "\n",
        "cut in a row": whole[: whole.rindex(",") - 12],
    }  # fmt: skip
    for label, content in contents.items():
        yield Case(f"file {label}", (FILE,), files={FILE: content})
    kinds = ("th1.mat", "th1.parquet", "th1.csv.gz")
    for kind in kinds:
        for label, raw in (("empty", b""), ("zeros", bytes(300)), ("noise", rng(5).bytes(300))):
            text = swapped('"th1.csv"', f'"{kind}"')
            yield Case(f"{kind} of {label}", (kind,), text, {kind: raw})
    for label, arrays in wrong_arrays().items():
        text = swapped('"th1.csv"', '"th1.mat"')
        yield Case(f"mat with {label}", ("th1.mat",), text, {"th1.mat": mat(arrays)})
    sheet = b"PK\x03\x04" + bytes(300)
    for name in ("th1.xlsx", "th1", "th1.json"):
        yield Case(f"kind {name}", (name,), swapped('"th1.csv"', f'"{name}"'), {name: sheet})
    for name in ("th2.csv", "data/th1.csv", "../th9.csv", "emps.csv"):
        yield Case(f"missing {name}", (name, "not found"), swapped('"th1.csv"', f'"{name}"'))
    yield Case("folder as file", ("th1.csv",), files={"th1.csv/inside.csv": whole})


def stretched_arms() -> Iterator[Case]:
    for k in range(0, 12, 3):
        near = (0.0, np.pi, -np.pi, 2 * np.pi)[k % 4] + float(rng(k).uniform(-0.03, 0.03))
        output = ("y", "ydot")[k % 2]
        lines, at = table(), COLUMNS.index("theta2")
        lines[1 + 9 * k][at] = f"{near:.6f}"
        text = swapped('output = "ydot"', f'output = "{output}"')
        yield Case(f"stretched {near:.3f} {output}", ("th1", "theta2", 'output = "z"'), text,
                   {FILE: csv(lines)})  # fmt: skip


def wrong_places() -> Iterator[Case]:
    files: dict[str, str | bytes] = {FILE: csv(table()), "taken": "x"}
    yield Case("output is a file", ("taken", "is a file", "--out"), files=files, out="taken")
    yield Case("output under a file", ("taken", "--out"), files=files, out="taken/report")
    yield Case("output is the scenario", (SCENARIO, "--out"), out=SCENARIO)


FAMILIES = (missing_scenarios, wrong_toml, bad_tables, bad_files, stretched_arms, wrong_places)

CASES = [case for family in FAMILIES for case in family()]
