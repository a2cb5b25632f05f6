"""An FMU 3.0: C code of the non-linear model, its description, a library for this platform."""

from __future__ import annotations

import hashlib
import math
import platform
import shutil
import subprocess
import sys
import tempfile
import uuid
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from flexgui import __version__
from flexgui.core.errors import InputError
from flexgui.core.recording.inputs import TIME
from flexgui.core.results import Outcome, Quantity, StateEquations
from flexgui.core.results.state_equations import per_second
from flexgui.core.units import base_units
from flexgui.export.folder import zipped
from flexgui.export.formats.arm_c import arm_sources
from flexgui.export.model_format import ModelFormat, no_equations, plain, whole_header
from flexgui.export.template import program, xml

IDENTIFIER = "flexarm"
NO_LIBRARY = "Sources only, because there was no C compiler. Tools that compile FMUs can use it."


class Fmu(ModelFormat):
    """The non-linear model; inputs are held over each communication step."""

    kind = "fmu"
    label = "Model as FMU 3.0 (.fmu)"
    hint = "The non-linear model; C sources and, with a compiler, a library for this platform."

    def unable(self, outcome: Outcome) -> str:
        return no_equations(outcome)

    def files(self, outcome: Outcome) -> dict[str, bytes]:
        return {"model.fmu": fmu(outcome)}


def fmu(outcome: Outcome) -> bytes:
    """The archive. The same outcome gives the same sources and description."""
    model = outcome.state_equations
    assert model is not None
    sources = arm_sources(outcome)
    token = _token(sources)
    names = [each.name for each in model.inputs]
    clock = names.index(TIME) if TIME in names else -1
    sources["fmi3.c"] = program("fmi3.c", token=token, clock=clock)
    library = shared_library(sources)
    inside = {f"sources/{name}": text.encode() for name, text in sources.items()}
    inside["sources/buildDescription.xml"] = xml(
        "buildDescription.xml", declared=True, identifier=IDENTIFIER,
        sources=sorted(name for name in sources if name.endswith(".c")),
    )  # fmt: skip
    inside["modelDescription.xml"] = _description(outcome, model, token, library is not None)
    if library is not None:
        inside[f"binaries/{library_place()}"] = library
    return zipped(dict(sorted(inside.items())))


def _token(sources: dict[str, str]) -> str:
    content = "".join(text for _, text in sorted(sources.items()))
    digest = hashlib.sha256(content.encode()).digest()
    return "{" + str(uuid.UUID(bytes=digest[:16])) + "}"


def _description(outcome: Outcome, model: StateEquations, token: str, compiled: bool) -> bytes:
    header = whole_header(outcome, "an FMU of the non-linear model")
    units = _units(model)
    return xml(
        "modelDescription.xml", declared=True, name=plain(outcome.title) or IDENTIFIER,
        identifier=IDENTIFIER, token=token, version=__version__, units=units,
        about=" ".join([*header, *([] if compiled else [NO_LIBRARY])]),
        variables=_variables(model, units),
    )  # fmt: skip


Attributes = dict[str, str]


def _units(model: StateEquations) -> dict[str, Attributes]:
    """Unit -> what it consists of; without those that nobody knows."""
    found: dict[str, Attributes] = {}
    rates = [per_second(each.unit) for each in model.states]
    groups = (model.states, model.inputs, model.outputs, model.parameters)
    for unit in dict.fromkeys([*(each.unit for group in groups for each in group), *rates]):
        try:
            factor, exponents = base_units(unit)
        except InputError:
            continue
        if unit:
            found[unit] = {name: str(power) for name, power in exponents.items()}
            found[unit] |= {} if math.isclose(factor, 1.0) else {"factor": repr(factor)}
    return found


def _variables(model: StateEquations, units: Mapping[str, Attributes]) -> list[Attributes]:
    """In the order of their value references; sources/fmi3.c counts the same way."""

    def all_of(letter: str, group: Iterable[Quantity], **more: str) -> list[Attributes]:
        return [_variable(f"{letter}.{each.name}", each, units, more) for each in group]

    held = {"causality": "local", "initial": "exact"}
    inputs = all_of("r", model.inputs, causality="input")
    for one, quantity in zip(inputs, model.inputs, strict=True):
        if quantity.name == TIME:
            one |= {"causality": "local"}
            del one["start"]
    first = 1 + sum(map(len, (model.inputs, model.parameters, model.outputs)))
    rates = [
        _variable(f"der(x.{each.name})", replace(each, unit=per_second(each.unit)), units,
                  {"causality": "local", "derivative": str(first + i)})
        for i, each in enumerate(model.states)
    ]  # fmt: skip
    outputs = all_of("y", model.outputs, causality="output")
    for one in (*outputs, *rates):
        del one["start"]
    return [
        {"name": "time", "causality": "independent", "variability": "continuous"},
        *inputs,
        *all_of("k", model.parameters, causality="parameter", variability="tunable"),
        *outputs,
        *all_of("x", model.states, **held),
        *rates,
    ]


def _variable(
    name: str, quantity: Quantity, units: Mapping[str, Attributes], more: Attributes
) -> Attributes:
    known = {"unit": quantity.unit} if quantity.unit in units else {}
    about = {"description": plain(quantity.title)} if quantity.title else {}
    return {"name": name, "start": repr(quantity.value), **known, **about, **more}


NAMES = ("cc", "gcc", "clang")

FLAGS = ("-std=c99", "-O2", "-shared", "-fPIC", "-fvisibility=hidden", "-ffp-contract=off")
"""Without fused multiply-add, so that the same source computes the same everywhere."""

PATIENCE = 60.0
"""s; it takes a fraction of one."""

SUFFIXES = {"linux": ".so", "darwin": ".dylib", "windows": ".dll"}


def compiler() -> str | None:
    """Path of the first C compiler found."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


def library_place() -> str:
    """Path of a shared library of this platform in an FMU (FMI 3.0, section 2.5.1.5)."""
    system = {"win32": "windows"}.get(sys.platform, sys.platform)
    machine = platform.machine().lower()
    names = {"amd64": "x86_64", "arm64": "aarch64"}
    return f"{names.get(machine, machine)}-{system}/{IDENTIFIER}{SUFFIXES.get(system, '.so')}"


def shared_library(sources: Mapping[str, str]) -> bytes | None:
    """The compiled library of C files (name -> text); None if no compiler works."""
    return _compiled(tuple(sorted(sources.items())))


@lru_cache(4)
def _compiled(sources: tuple[tuple[str, str], ...]) -> bytes | None:
    path = compiler()
    if path is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        for name, text in sources:
            (Path(folder) / name).write_text(text, encoding="utf-8")
        files = [name for name, _ in sources if name.endswith(".c")]
        order = [path, *FLAGS, "-o", "library", *files, "-lm"]
        try:
            subprocess.run(order, cwd=folder, check=True, capture_output=True, timeout=PATIENCE)
            return (Path(folder) / "library").read_bytes()
        except (OSError, subprocess.SubprocessError):
            return None
