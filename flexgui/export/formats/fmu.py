"""An FMU 3.0 for co-simulation: the C code, its description, and a library for this platform."""

from __future__ import annotations

import hashlib
import uuid
from collections.abc import Iterator
from xml.etree import ElementTree

from core.results import DescriptorModel, Outcome
from flexgui import __version__
from flexgui.export.basis import scheduled
from flexgui.export.c_compiler import library_place, shared_library
from flexgui.export.formats.c_code import c_sources, c_template
from flexgui.export.formats.python_control import ELBOW
from flexgui.export.model_format import ModelFormat, linear_header, plain
from flexgui.export.zipped import zipped

IDENTIFIER = "flexmodel"
NO_LIBRARY = (
    "It holds sources only: there was no C compiler where it was written. Tools that compile FMUs "
    "can use it."
)


class Fmu(ModelFormat):
    """Steps exactly over any communication step, with inputs and posture held."""

    kind = "fmu"
    label = "Model as FMU 3.0 (.fmu)"
    hint = "Co-simulation, with C sources and, where a compiler is, a library of this platform."

    def files(self, outcome: Outcome) -> dict[str, bytes]:
        return {"model.fmu": fmu(outcome)}


def fmu(outcome: Outcome) -> bytes:
    """The archive. The same outcome gives the same sources and description."""
    sources = c_sources(outcome)
    token = _token(sources)
    names = scheduled((*outcome.model.basis, *outcome.model.A_basis))
    postures = ", ".join(repr(ELBOW) for _ in names) or "0.0"
    sources["fmi3.c"] = c_template("fmi3.c", {"token": token, "postures": postures})
    library = shared_library(sources)
    inside = {f"sources/{name}": text.encode() for name, text in sources.items()}
    inside["sources/buildDescription.xml"] = _build_description(sources)
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
    root = ElementTree.Element(
        "fmiModelDescription",
        fmiVersion="3.0", modelName=plain(outcome.title) or IDENTIFIER, instantiationToken=token,
        description=" ".join([*header, *([] if compiled else [NO_LIBRARY])]),
        generationTool=f"FlexGUI {__version__}", variableNamingConvention="structured",
    )  # fmt: skip
    ElementTree.SubElement(
        root, "CoSimulation", modelIdentifier=IDENTIFIER,
        canHandleVariableCommunicationStepSize="true", canGetAndSetFMUState="true",
    )  # fmt: skip
    variables = ElementTree.SubElement(root, "ModelVariables")
    structure = ElementTree.SubElement(root, "ModelStructure")
    for reference, attributes in enumerate(_variables(outcome.model)):
        attributes["valueReference"] = str(reference)
        ElementTree.SubElement(variables, "Float64", attributes)
        if attributes["causality"] == "output":
            ElementTree.SubElement(structure, "Output", valueReference=str(reference))
    for output in structure.findall("Output"):
        ElementTree.SubElement(structure, "InitialUnknown", output.attrib)
    return _xml(root)


def _variables(model: DescriptorModel) -> Iterator[dict[str, str]]:
    """Attributes in the order of their value references; sources/fmi3.c counts the same way."""
    yield {"name": "time", "causality": "independent", "variability": "continuous"}
    for name in model.inputs:
        yield {"name": f"u.{name}", "causality": "input", "start": "0"}
    for name in scheduled((*model.basis, *model.A_basis)):
        yield {"name": f"posture.{name}", "causality": "input", "start": repr(ELBOW)}
    for name in model.outputs:
        yield {"name": f"y.{name}", "causality": "output"}
    for name in model.states:
        yield {"name": f"x.{name}", "causality": "local", "initial": "exact", "start": "0"}


def _build_description(sources: dict[str, str]) -> bytes:
    root = ElementTree.Element("fmiBuildDescription", fmiVersion="3.0")
    how = ElementTree.SubElement(root, "BuildConfiguration", modelIdentifier=IDENTIFIER)
    files = ElementTree.SubElement(how, "SourceFileSet", language="C99")
    for name in sorted(name for name in sources if name.endswith(".c")):
        ElementTree.SubElement(files, "SourceFile", name=name)
    ElementTree.SubElement(how, "Library", name="m")
    return _xml(root)


def _xml(root: ElementTree.Element) -> bytes:
    ElementTree.indent(root)
    text: bytes = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
    return text + b"\n"
