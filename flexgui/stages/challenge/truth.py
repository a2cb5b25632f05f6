"""What a challenge hides: made in a worker, and told to a person."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from flexgui.core.effects import effect
from flexgui.core.effects.sizes import typical

if TYPE_CHECKING:
    from flexgui.core.parameters import Parameter
    from flexgui.core.progress import Progress


def hide(seed: int, level: str, folder: str, *, progress: Progress) -> tuple[str, str]:
    """(scenario as TOML, obfuscated truth); the recordings lie in `folder` afterwards."""
    from flexgui.core.recording.save import save_recording
    from flexgui.core.scenario.read import scenario_toml
    from flexgui.core.study.challenge import make_challenge

    progress.stage("Hiding an effect in an arm, and recording it")
    made = make_challenge(seed, level)
    for r in made.recordings:
        save_recording(r, Path(folder) / f"{r.name}.csv")
    return scenario_toml(made.scenario), made.obfuscated


def revealed(place: Path) -> str:
    """The truth in words; InputError where there is none or its checksum is wrong.

    `place` is a challenge's folder, its zip, or the obfuscated file itself.
    """
    from flexgui.core.study.challenge import TRUTH_FILE, obfuscated_truth, opened

    return truth_in_words(opened(obfuscated_truth(place), TRUTH_FILE))


def truth_in_words(text: str) -> str:
    """What was obfuscated, for a person: the effects, their sizes, how well they show."""
    from flexgui.core.study.rig import bare_model

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
