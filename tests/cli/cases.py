"""Bad input of every kind, generated from fixed seeds."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO

import numpy as np
from scipy.io import savemat

from tests.cli.helpers import COLUMNS, FILE, ROWS, SCENARIO, TEXT, Case, csv, swapped, table

RECORDING = '[[recordings]]\nfile = "th1.csv"\ntheta2 = 1.2\n'
ENCODERS = ("theta1", "theta2")
REFERENCES = ("dtheta1_ref", "dtheta2_ref")


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
    for k, bad in enumerate(garbage * 3):
        at = int(rng(k).integers(1, len(lines)))
        text = "\n".join([*lines[:at], bad, *lines[at:]])
        yield Case(f"toml {k} {bad} at {at}", (SCENARIO, "not valid TOML"), text)
    yield Case(
        "toml of a key given twice", (SCENARIO, "not valid TOML"), TEXT + "max_effects = 1\n"
    )


KEYS = (
    ("preset", "prest"), ("kind", "knd"), ("gains", "gain"), ("level", "levle"),
    ("camera_noise", "camera_nois"), ("file", "flie"), ("theta2", "theta_2"),
    ("parameters", "paramters"), ("output", "ouput"), ("generations", "generation"),
    ("population", "populaton"), ("bounds", "bound"), ("max_effects", "max_effect"),
    ("title", "titel"), ("[arm]", "[amr]"), ("[model]", "[modle]"), ("[sensors]", "[sensor]"),
    ("[diagnose]", "[diagnosis]"), ("[identify]", "[identfy]"), ("[drive]", "[driv]"),
)  # fmt: skip


def unknown_keys() -> Iterator[Case]:
    for key, wrong in KEYS:
        old, new = (key, wrong) if key.startswith("[") else (f"{key} =", f"{wrong} =")
        words = (wrong.strip("[]"), "did you mean", key.strip("[]"))
        yield Case(f"key {wrong}", words, swapped(old, new))


VALUES = (
    ("population = 10", "population = 2", "population"),
    ("population = 10", 'population = "many"', "population"),
    ("population = 10", "population = 10.5", "population"),
    ("generations = 0", "generations = -1", "generations"),
    ("generations = 0", "generations = true", "generations"),
    ("generations = 0", "generations = 0\nseed = -3", "seed"),
    ("generations = 0", "generations = 0\ndecimate = 0", "decimate"),
    ("generations = 0", "generations = 0\nservo_hz = 0.0", "servo_hz"),
    ("generations = 0", 'generations = 0\nmethod = "globl"', "method"),
    ("generations = 0", "generations = 0\nweights = {ydot1 = -1.0}", "weights"),
    ("generations = 0", "generations = 0\nweights = {speed = 1.0}", "speed"),
    ("generations = 0", "generations = 0\nprior = {EI1 = 0.0}", "prior"),
    ("generations = 0", "generations = 0\nprior = {EI3 = 5.0}", "EI3"),
    ("generations = 0", "generations = 0\nstart = {EI1 = 900.0}", "EI1"),
    ("generations = 0", "generations = 0\nstart = {EI2 = nan}", "EI2"),
    ("generations = 0", "generations = 0\nfilter = {cutoff_hz = -5.0}", "cutoff_hz"),
    ("generations = 0", "generations = 0\nfilter = {cutoff_hz = 900.0}", "cutoff_hz"),
    ("generations = 0", "generations = 0\nfilter = {cutof_hz = 9.0}", "cutof_hz"),
    ("EI1 = [400.0, 700.0]", "EI1 = [700.0, 400.0]", "EI1"),
    ("EI1 = [400.0, 700.0]", "EI1 = [600.0, 700.0]", "EI1"),
    ("EI1 = [400.0, 700.0]", "EI1 = [400.0]", "EI1"),
    ("EI1 = [400.0, 700.0]", "EI2 = [900.0, 950.0]", "EI2"),
    ("EI1 = [400.0, 700.0]", "lambda1 = [1.0, 2.0]", "lambda1"),
    ("EI1 = [400.0, 700.0]", "EI1 = [400.0, inf]", "EI1"),
    ('output = "ydot"', 'output = "tip"', "output"),
    ('output = "ydot"', 'output = ["ydot", "ydot"]', "output"),
    ('output = "ydot"', 'output = "deflection"', "deflection1"),
    ('level = "lpv"', 'level = "linear"', "level"),
    ("camera_noise = 3e-5", "camera_noise = -1.0", "camera_noise"),
    ("max_effects = 0", "max_effects = -1", "max_effects"),
    ("theta2 = 1.2", 'role = "test"', "role"),
    ("theta2 = 1.2", "window = [2.0, 1.0]", "window"),
    ("theta2 = 1.2", "window = [5.0, 6.0]", "window"),
    ("theta2 = 1.2", "mask = {ydot9 = [[0.0, 1.0]]}", "ydot9"),
    ("theta2 = 1.2", "mask = {deflection1 = [[0.0, 1.0]]}", "deflection1"),
    ("theta2 = 1.2", "logger_filter = {z1 = {frequency = 0.0, damping = 1.0}}", "frequency"),
    ("theta2 = 1.2", 'columns = {theta1 = "q1"}', "q1"),
    ("theta2 = 1.2", 'columns = {theta9 = "theta1"}', "theta9"),
    ("theta2 = 1.2", "camera = {scale = 0.0}", "scale"),
    ("theta2 = 1.2", "time_shift = 9.0", "time_shift"),
    ('file = "th1.csv"', "name = \"r\"", "recordings"),
    ('file = "th1.csv"', 'file = "th1.csv"\nsimulate = {theta2 = 1.0}', "simulate"),
)  # fmt: skip


def wrong_values() -> Iterator[Case]:
    for old, new, word in VALUES:
        yield Case(f"value {old} {new.splitlines()[-1]}", (word,), swapped(old, new))


def unknown_parameters() -> Iterator[Case]:
    names = {
        "EI11": "EI1", "ei1": "EI1", "epsilonn": "epsilon", "lamda1": "lambda1", "mass1": "m",
        "m3": "m", "tau9": "tau", "gain_ydot7": "ydot", "offset_zz1": "z", "start_theta7": "theta",
    }  # fmt: skip
    for name, near in names.items():
        yield Case(f"parameter {name}", (name.removeprefix("gain_").removeprefix("offset_"), near),
                   swapped('["EI1", "EI2"]', f'["EI1", "{name}"]'))  # fmt: skip
    yield Case("parameter twice", ("EI1", "twice"), swapped('["EI1", "EI2"]', '["EI1", "EI1"]'))
    yield Case("parameter empty", ("parameters",), swapped('["EI1", "EI2"]', '["EI1", ""]'))
    yield Case("offset of nothing", ("offsets", "did you mean"),
               swapped("generations = 0", 'generations = 0\noffsets = ["ydot7"]'))  # fmt: skip
    yield Case("own friction", ("fc1",),
               swapped("generations = 0", 'generations = 0\nper_recording = ["fc1"]'))  # fmt: skip


ARMS = (
    ("mass = -1.0", "mass"), ("mass = [7.5, 0.0]", "mass"), ("mass = [7.5]", "mass"),
    ("length = 0.0", "length"), ("length = nan", "length"), ("modes = 9", "modes"),
    ("modes = [1, -1]", "modes"), ("modes = 1.5", "modes"), ("width = -0.05", "width"),
    ("young_modulus = 0.0", "young_modulus"), ("EI = -500.0", "EI"),
    ("tip_mass = -0.1", "tip_mass"),
    ("hub_inertia = -0.1", "hub_inertia"), ("damping_time = -1.0", "damping_time"),
    ('joint = "ball"', "joint"), ("gravity = [0.0]", "gravity"), ('mass = "heavy"', "mass"),
    ("masss = 3.0", "masss"),
)  # fmt: skip


def wrong_arms() -> Iterator[Case]:
    for line, word in ARMS:
        yield Case(f"arm {line}", (word,), swapped('"paper"\n', f'"paper"\n{line}\n'))
    yield Case("arm preset", ("papper", "paper"), swapped('"paper"', '"papper"'))


def wrong_drives() -> Iterator[Case]:
    lines = {
        'kind = "velocity_lop"': ("velocity_lop", "velocity_loop"),
        'kind = "torque"': ("gains",),
        'kind = "cascade"': ("gains",),
        'kind = ""': ("kind",),
    }
    for line, words in lines.items():
        yield Case(f"drive {line}", ("[drive]", *words), swapped('kind = "velocity_loop"', line))
    for line, word in (
        ("gains = [60.0]", "gains"), ("gains = [60.0, 30.0, 1.0]", "gains"),
        ("gains = [60.0, -1.0]", "gains"), ('gains = "high"', "gains"), ("gains = 60.0", "gains"),
        ("gains = [60.0, 30.0]\nlimits = [1.0]", "limits"),
        ("gains = [60.0, 30.0]\nlimts = [1.0, 1.0]", "limts"),
        ("gains = [60.0, 30.0]\ntorque_constants = [1.0, 1.0]", "torque_constants"),
    ):  # fmt: skip
        yield Case(f"drive {line}", ("[drive]", word), swapped("gains = [60.0, 30.0]", line))


def missing_columns() -> Iterator[Case]:
    for name in ("t", *REFERENCES):
        for how in ("removed", "renamed", "misspelt"):
            lines, k = table(), COLUMNS.index(name)
            if how == "removed":
                lines = [[*line[:k], *line[k + 1 :]] for line in lines]
            else:
                lines[0][k] = f"my_{name}" if how == "renamed" else name + "x"
            yield of_table(f"column {name} {how}", lines, f"no column {name}")
    for name in ("theta1", "theta2", "z1", "z2"):
        k = COLUMNS.index(name)
        lines = [[*line[:k], *line[k + 1 :]] for line in table()]
        yield of_table(f"column {name} removed", lines, f"no column {name}")


def bad_cells() -> Iterator[Case]:
    columns = ("t", *REFERENCES, *ENCODERS)
    for k in range(30):
        draw = rng(100 + k)
        row, name = int(draw.integers(1, ROWS + 1)), columns[k % len(columns)]
        cell = ("", "NaN", "nan", "abc", "inf", "1.2.3")[int(draw.integers(6))]
        lines = table()
        lines[row][COLUMNS.index(name)] = cell
        yield of_table(f"cell {k} {cell!r} in {name}, {row}", lines, name, f"row {row}")
    lines = table()
    lines[87][COLUMNS.index("dtheta2_ref")] = "1e15"
    yield Case("the largest number that is read", ("far too large",), files={FILE: csv(lines)})


def bad_times() -> Iterator[Case]:
    for k in range(24):
        draw = rng(200 + k)
        row = int(draw.integers(2, ROWS - 1))
        lines = table()
        how = ("gap", "back", "twice", "late")[k % 4]
        if how == "gap":
            for line in lines[row:]:
                line[0] = f"{float(line[0]) + 0.01:.6f}"
        else:
            shift = {"back": -0.0035, "twice": -0.001, "late": 0.0004}[how]
            lines[row][0] = f"{float(lines[row][0]) + shift:.6f}"
        yield of_table(f"time {k} {how} at {row}", lines, "column t", "row")


def bad_units() -> Iterator[Case]:
    units = {
        "t": ("m", "Hz"), "dtheta1_ref": ("rad", "m", "deg"), "theta1": ("N m", "s", "deg/s"),
        "z1": ("rad", "s", "kg"), "theta2": ("mm", "?", "m^2"), "dtheta2_ref": ("mm/s",),
    }  # fmt: skip
    for name, wrong in units.items():
        for unit in wrong:
            lines = table()
            lines[0][COLUMNS.index(name)] = f"{name} [{unit}]"
            yield of_table(f"unit {name} [{unit}]", lines, f"{name} [{unit}]")


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
    for k in range(12):
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


def later_words() -> Iterator[Case]:
    """What this version cannot do is refused, not ignored."""
    friction = 'level = "lpv"\neffects = [{id = "colomb_friction"}]'
    effects = ("[model] effects", "coulomb_friction")
    yield Case("effects", effects, swapped('level = "lpv"', friction))
    yield Case(
        "no recordings",
        ("recordings",),
        swapped(RECORDING, ""),
    )
    yield Case("nothing to estimate from", ("estimate",),
               swapped("theta2 = 1.2", 'theta2 = 1.2\nrole = "validate"'))  # fmt: skip
    for line, word in (
        ("{theta2 = 1.0, seconds = -1.0}", "seconds"), ("{theta2 = 1.0, secs = 1.0}", "secs"),
        ("{theta = [1.0], seconds = 0.1}", "theta"), ('{excitation = "noise"}', "excitation"),
        ("{sweep = [-0.5, 0.5], seconds = 0.1}", "sweep"), ("{seconds = 0.001}", "fewer than 10"),
        ("{theta2 = 0.01, seconds = 0.1}", "theta2"), ("{amplitude = 0.0}", "amplitude"),
        ("{theta2 = 1.0, hidden = {coulomb_friction = {fc9 = 1.0}}}", "hidden"),
        ('{theta2 = 1.0, seconds = 0.1, options = {highest = 3.0}}', "highest"),
    ):  # fmt: skip
        yield Case(f"simulate {line}", (word,),
                   swapped('file = "th1.csv"\ntheta2 = 1.2', f"simulate = {line}"))  # fmt: skip


FAMILIES = (
    missing_scenarios, wrong_toml, unknown_keys, wrong_values, unknown_parameters, wrong_arms,
    wrong_drives, missing_columns, bad_cells, bad_times, bad_units, bad_files, stretched_arms,
    wrong_places, later_words,
)  # fmt: skip

CASES = [case for family in FAMILIES for case in family()]
