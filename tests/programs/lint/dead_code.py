"""What nothing in the program uses, by vulture: `python -m tests.programs.lint.dead_code`.

Tests do not count as users: what only they use is dead in the product.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

from vulture import Vulture

ROOT = Path(__file__).resolve().parents[3]
PATHS = [ROOT / "core", ROOT / "flexgui", ROOT / "docs" / "examples"]

FOUND_IN_FOLDERS = (
    "core/arm/joints", "core/check/checks", "core/drives", "core/effects", "core/excitation",
    "core/montecarlo/parts", "core/recording/readers", "core/sensors", "flexgui/stages",
    "flexgui/export/formats", "flexgui/views/of_recording",
)  # fmt: skip
"""Classes in these folders are plug-ins, found by walking them."""

DECORATED = ["@model_validator", "@field_validator", "@infer_global", "@register_default",
             "@lower_*", "@checked.register", "@app.*"]  # fmt: skip
"""What libraries call: Pydantic, Numba, singledispatch, Typer."""

PROTOCOLS = [
    "_print_*", "printmethod", "_pythoncode", "_numpycode",  # SymPy's printers
    "eval", "fdiff", "is_real",  # and functions
    "get_source", "fullname",  # importlib's loaders
    "model_config", "_repr_html_", "__*", "_", "CACHE_DIR", "get_suitable_cache_subpath",
    "animated", "up_direction", "image", "colors", "to_json",  # viser's
    "_plotly_json_str", "_setup_plotly_js", "_sanctioned_dead_writes", "_lower", "_Typing",
    "unify", "can_convert_from",  # Numba's types
    "mime_type", "part_index",  # fields of the messages of viser's client
]  # fmt: skip
"""Names that somebody else's code looks for."""

READ_BY_NAME = {
    "camera_noise", "encoder_noise", "deflection_noise", "torque_noise", "rates_noise",
    "warm_file_worker", "straight_line", "validation_fit_percent",
    "singular_values", "residual_count", "gradient_norm", "rigid_base", "camera_synchronised",
    "gauges_calibrated", "encoders_calibrated",
}  # fmt: skip
"""Settings that sensors name, statements about a rig that effects name, a task that its worker
finds by its name, what generated modules import, and fields of results that are written as they
are."""

PUBLIC = {"compare_as_given", "to_casadi", "to_control", "to_dataframe", "to_scipy"}
"""Of the library's results: for scripts and notebooks."""

FOR_TESTS = {
    "dissipative": "what the energy test of every effect looks at",
    "iterations": "how many steps a descent took",
    "pids": "the processes of an executor, to end one",
    "whitened_reduction": "flexgui.core.diagnose",
}
"""Name -> what tests look at there. It must only shrink."""


def unused() -> Iterator[str]:
    """`file:line: name`, in the order of the files."""
    scan = Vulture(ignore_names=PROTOCOLS, ignore_decorators=DECORATED)
    scan.scavenge([str(path) for path in PATHS])
    known = READ_BY_NAME | PUBLIC | set(FOR_TESTS) | template_words() | generated_words()
    for item in scan.get_unused_code(min_confidence=60):
        place = Path(item.filename).resolve().relative_to(ROOT)
        plug_in = item.typ == "class" and place.as_posix().startswith(FOUND_IN_FOLDERS)
        if not plug_in and item.name not in known:
            yield f"{place}:{item.first_lineno}: {item.typ} {item.name}"


def template_words() -> set[str]:
    """What the templates of the report and of the panels may read of an object."""
    rooms = (ROOT / "flexgui" / "export", ROOT / "flexgui" / "stages")
    pages = (page for room in rooms for page in room.rglob("*.j2"))
    texts = [page.read_text(encoding="utf-8") for page in pages]
    inside = [part for text in texts for part in re.findall(r"\{[{%](.*?)[%}]\}", text, re.DOTALL)]
    return set(re.findall(r"\w+", " ".join(inside)))


def generated_words() -> set[str]:
    """What the modules generated for an arm import."""
    texts = [f.read_text(encoding="utf-8") for f in (ROOT / "core" / "arm").glob("*template.txt")]
    lines = re.findall(r"^from \S*core\S* import (.+)$", "\n".join(texts), re.MULTILINE)
    return set(re.findall(r"\w+", " ".join(lines)))


def main() -> int:
    """Print what is unused; 1 where there is any."""
    found = list(unused())
    print("\n".join([*found, f"{len(found)} unused"] if found else ["No dead code."]))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
