"""Centre of mass and inertia of rigid links: found where gravity shows them, else named as one."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.segment import Segment
from flexgui.core.identify.fit import Fitted
from flexgui.core.simulate.experiment import NoiseLevels
from flexgui.sentences.identifiability import identifiability_sentences
from tests.helpers import looped
from tests.identify.helpers import fit, simulated

TRUE = {"xc1": 0.21, "Jc1": 0.09, "xc2": 0.16, "Jc2": 0.03}
"""m and kg m²; the uniform beams from which the fits begin have 0.25, 0.083, 0.2 and 0.027."""

DEVIATIONS, KNOWN = 4.0, 0.05
"""An estimate is nearer to the truth than that, in standard deviations, and they are at most this
share of it: one that states no deviation is no success."""


def arm(upright: bool, *stated: dict[str, float]) -> Arm:
    sizes = ({"length": 0.5, "mass": 4.0}, {"length": 0.4, "mass": 2.0})
    tables = stated or ({}, {})
    links = tuple(
        Segment(**size, **table, modes=0, hub_inertia=0.03)
        for size, table in zip(sizes, tables, strict=True)
    )
    return Arm(segments=links, gravity=(0.0, -9.81 if upright else 0.0))


def fitted(upright: bool) -> Fitted:
    """Of two recordings with the noise of an encoder."""
    links = [{"centre_of_mass": TRUE[f"xc{k}"], "inertia": TRUE[f"Jc{k}"]} for k in (1, 2)]
    recordings = simulated(
        looped(arm(upright, *links), 20.0), points=(0.8, 2.0), seconds=2.0, amplitude=1.0,
        noise=NoiseLevels({"encoder": 1e-4}),
    )  # fmt: skip
    return fit(looped(arm(upright), 20.0), recordings, parameters=tuple(TRUE), output=("encoder",))


def test_gravity_tells_centre_and_inertia_apart() -> None:
    found = fitted(upright=True).fit
    assert identifiability_sentences(found) == ("All estimated parameters are identifiable.",)
    for e in found.estimates:
        assert abs(e.value - TRUE[e.name]) < DEVIATIONS * e.std
        assert e.std < KNOWN * TRUE[e.name]


def test_without_gravity_the_first_links_are_one_number() -> None:
    """Its inertia about the joint, J_c + m x_c², and the second link's apart."""
    found = fitted(upright=False).fit
    told = identifiability_sentences(found)[0]
    assert "xc1 and Jc1" in told and "xc2" not in told
    assert [e.identifiable for e in found.estimates] == [False, False, True, True]
    value = {e.name: e.value for e in found.estimates}
    about_joint = value["Jc1"] + 4.0 * value["xc1"] ** 2
    assert about_joint == pytest.approx(TRUE["Jc1"] + 4.0 * TRUE["xc1"] ** 2, rel=KNOWN)
    assert np.isfinite([e.std for e in found.estimates[2:]]).all()
