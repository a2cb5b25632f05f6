"""An FMU 3.0 for co-simulation: the C code, its description, and a library for this platform."""

from __future__ import annotations

import hashlib
import platform
import shutil
import subprocess
import sys
import tempfile
import uuid
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

from flexgui import __version__
from flexgui.core.results import DescriptorModel, Outcome
from flexgui.export.folder import zipped
from flexgui.export.formats.c_code import c_sources
from flexgui.export.formats.python_control import ELBOW
from flexgui.export.model_format import ModelFormat, linear_header, plain, scheduled
from flexgui.export.template import program, xml

IDENTIFIER = "flexmodel"
NO_LIBRARY = "Sources only, because there was no C compiler. Tools that compile FMUs can use it."


class Fmu(ModelFormat):
    """Steps exactly over any communication step, with inputs and posture held."""

    kind = "fmu"
    label = "Model as FMU 3.0 (.fmu)"
    hint = "Co-simulation: C sources and, with a compiler, a library for this platform."

    def files(self, outcome: Outcome) -> dict[str, bytes]:
        return {"model.fmu": fmu(outcome)}


def fmu(outcome: Outcome) -> bytes:
    """The archive. The same outcome gives the same sources and description."""
    sources = c_sources(outcome)
    token = _token(sources)
    names = scheduled((*outcome.model.basis, *outcome.model.A_basis))
    postures = ", ".join(repr(ELBOW) for _ in names) or "0.0"
    sources["fmi3.c"] = program("fmi3.c", token=token, postures=postures)
    library = shared_library(sources)
    inside = {f"sources/{name}": text.encode() for name, text in sources.items()}
    inside["sources/buildDescription.xml"] = xml(
        "buildDescription.xml", declared=True, identifier=IDENTIFIER,
        sources=sorted(name for name in sources if name.endswith(".c")),
    )  # fmt: skip
    inside["modelDescription.xml"] = _description(outcome, token, library is not None)
    if library is not None:
        inside[f"binaries/{library_place()}"] = library
    return zipped(dict(sorted(inside.items())))


def _token(sources: dict[str, str]) -> str:
    content = "".join(text for _, text in sorted(sources.items()))
    digest = hashlib.sha256(content.encode()).digest()
    return "{" + str(uuid.UUID(bytes=digest[:16])) + "}"


def _description(outcome: Outcome, token: str, compiled: bool) -> bytes:
    header = linear_header(outcome, "an FMU of the linear model")
    return xml(
        "modelDescription.xml", declared=True, name=plain(outcome.title) or IDENTIFIER,
        identifier=IDENTIFIER, token=token, version=__version__,
        about=" ".join([*header, *([] if compiled else [NO_LIBRARY])]),
        variables=_variables(outcome.model),
    )  # fmt: skip


def _variables(model: DescriptorModel) -> list[dict[str, str]]:
    """Attributes in the order of their value references; sources/fmi3.c counts the same way."""
    postures = scheduled((*model.basis, *model.A_basis))
    local = {"causality": "local", "initial": "exact", "start": "0"}
    return [
        {"name": "time", "causality": "independent", "variability": "continuous"},
        *({"name": f"u.{n}", "causality": "input", "start": "0"} for n in model.inputs),
        *({"name": f"posture.{n}", "causality": "input", "start": repr(ELBOW)} for n in postures),
        *({"name": f"y.{n}", "causality": "output"} for n in model.outputs),
        *({"name": f"x.{n}"} | local for n in model.states),
    ]


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
    return f"{names.get(machine, machine)}-{system}/flexmodel{SUFFIXES.get(system, '.so')}"


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
