"""What a challenge hides, for a person."""

from __future__ import annotations

import json
from pathlib import Path

from flexgui.core.effects import effect
from flexgui.core.effects.sizes import typical
from flexgui.core.parameters import Parameter
from flexgui.core.study.challenge import TRUTH_FILE, obfuscated_truth, opened
from flexgui.core.study.rig import bare_model


def revealed(place: Path) -> str:
    """The truth in words; InputError where there is none or its checksum is wrong.

    `place` is a challenge's folder, its zip, or the obfuscated file itself.
    """
    return truth_in_words(opened(obfuscated_truth(place), TRUTH_FILE))


def truth_in_words(text: str) -> str:
    """What was obfuscated, for a person: the effects, their sizes, how well they show."""
    truth = json.loads(text)
    values, shown = truth["values"], truth["shown"]
    kinds = [effect(kind) for kind in truth["effects"]]
    model = bare_model().with_effects(kinds, values)
    nominal = bare_model().parameters["EI"].value
    lines = [f"Challenge {truth['seed']} ({truth['level']}). Hidden:"]
    for one in model.effects:
        quantities = one.parameters(model.arm, model.drive, typical(model.arm))
        # A size of zero hides nothing, such as the delay of a sensor that is not there.
        stated = [q.parameter for q in quantities if values.get(q.parameter.name)]
        sizes = [_size(parameter, values[parameter.name]) for parameter in stated]
        lines.append(f"- {one.title} ({one.kind}){': ' if sizes else ''}{'; '.join(sizes)}.")
        if one.kind in shown:
            lines.append(
                f"  Beyond what nominal parameters can absorb it shows {shown[one.kind]:.1f} times "
                f"the noise."
            )
    lines.append(
        f"The true bending stiffness is EI = {truth['EI']:.2f} N m² (nominal {nominal:.2f} N m²)."
    )
    return "\n".join(lines)


def _size(p: Parameter, value: float) -> str:
    return f"{p.title} {p.name} = {value:.4g} {p.unit}".strip()
