"""What others would use, on equal data."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from scipy.optimize import lsq_linear

from tests.programs.evidence.emps_rules import ESTIMATED, JUDGED, inverse_model, percent
from tests.programs.evidence.emps_rules import table as recording
from tests.programs.evidence.frame import table

TITLE = "Peers on equal data"
ORDER = 3
FILES = (ESTIMATED, JUDGED)


def least_squares_emps(folder: Path) -> dict[str, Any]:
    """SciPy's linear least squares on the inverse model: what one writes for this slide by hand."""
    found = {}
    for name, signs in (("symmetric", False), ("asymmetric", True)):
        X, force = inverse_model(recording(folder, ESTIMATED), signs)
        values = lsq_linear(X, force).x
        other, judged = inverse_model(recording(folder, JUDGED), signs)
        found[name] = {
            "values": values.tolist(),
            "direct": percent(force, X @ values),
            "cross": percent(judged, other @ values),
        }
    return found


CASES = {"least_squares_emps": least_squares_emps}


def section(found: Mapping[str, Any]) -> str:
    """Markdown."""
    texts = []
    if "least_squares_emps" in found:
        rows = [[name, f"{one['direct']:.2f} %", f"{one['cross']:.2f} %"]
                for name, one in found["least_squares_emps"].items()]  # fmt: skip
        texts += [
            "**EMPS by SciPy** (`lsq_linear` on the inverse model). The parameters are mass, "
            "viscous and Coulomb friction, and an offset or an asymmetry, which a person must "
            "choose. The filters and rules are those above. It is as quick to compute. Its "
            "friction is the sign of a filtered velocity; ours is simulated.",
            table(("friction", "direct", "judged on the pulses"), rows),
        ]
    return "\n\n".join(texts)
