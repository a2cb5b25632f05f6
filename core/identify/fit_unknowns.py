"""All that a fit estimates: what a scenario asks for, and what rig and recordings leave open."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..identify.unknown_gains import gain_unknowns
from ..identify.unknowns import (
    Unknown,
    Unknowns,
    collect_unknowns,
    start_parameter,
    starts_unknown,
)
from ..model import Model
from ..recording.recording import Recording
from ..scenario.schema import IdentifySpec
from ..sensors.sensor import Sensor

INITIAL_JOINT_BOUND = 0.05
"""rad (m): largest error of an encoder's first sample."""


def unknowns_with_starts(
    model: Model, spec: IdentifySpec, recordings: Sequence[Recording], outputs: Sequence[Sensor]
) -> Unknowns:
    """What [identify] asks for, the gains of compared channels that nobody states and, where a
    drive holds the joints and the outputs show places, the place of each joint at the first sample
    of a recording that begins at rest. The encoder's first reading is no better than any other,
    and every later place has its error."""
    items = collect_unknowns(model, spec, recordings).items
    items += gain_unknowns(model, outputs, recordings, items, spec.start)
    if model.steering is not None or not any(s.drifts for s in outputs):
        return Unknowns(items)
    resting = [r for r in recordings if not starts_unknown(spec, r)]
    own = [
        Unknown(replace(p, lower=-INITIAL_JOINT_BOUND, upper=INITIAL_JOINT_BOUND), r.name, False)
        for p in (start_parameter(model, f"theta{k + 1}") for k in range(model.arm.joints))
        for r in resting
    ]
    stated = {item.label for item in items}
    return Unknowns((*items, *(item for item in own if item.label not in stated)))
