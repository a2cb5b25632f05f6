"""Colours that stand in one figure are told apart without red or green receptors too."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from flexgui.views import colours

SIGHT = {
    "all receptors": np.eye(3),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413],
         [-0.011820, 0.042940, 0.968881]]),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216],
         [-0.003882, -0.048116, 1.051998]]),
}  # fmt: skip
"""Linear RGB as such eyes see it: Machado, Oliveira and Fernandes, IEEE Transactions on
Visualization and Computer Graphics 15 (2009), severity 1."""
TO_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750],
     [0.0193339, 0.1191920, 0.9503041]])  # fmt: skip
"""From linear sRGB, IEC 61966-2-1."""
WHITE = np.array([0.95047, 1.0, 1.08883])
APART = 12.0
"""CIE 1976 colour difference: five times what is just noticeable (2.3, Mahy et al. 1994), for
areas that do not touch."""

TOGETHER = {
    "measured and model": [colours.MEASURED, colours.MODEL],
    "residual and effect": [colours.RESIDUAL, colours.ADDED],
    "both ways of a joint": [colours.MISSING, colours.BACKWARDS],
    "joints": list(colours.JOINTS),
    "several alike": list(colours.SERIES[:4]),
}  # fmt: skip


def seen(colour: str, sight: str) -> np.ndarray:
    """CIELAB (3,) of '#rrggbb'."""
    coded = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0
    light = np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)
    xyz = TO_XYZ @ np.clip(SIGHT[sight] @ light, 0.0, 1.0) / WHITE
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16.0 / 116.0)
    return np.array([116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])])


@pytest.mark.parametrize("sight", SIGHT)
@pytest.mark.parametrize("what", TOGETHER)
def test_colours_of_one_figure_differ_for_every_eye(what: str, sight: str) -> None:
    alike = {
        (one, other): float(distance)
        for one, other in combinations(TOGETHER[what], 2)
        if (distance := np.linalg.norm(seen(one, sight) - seen(other, sight))) < APART
    }
    assert not alike


def test_the_simulation_of_sight_merges_what_such_eyes_confuse() -> None:
    red, green = "#c00000", "#6a6a00"
    all_receptors, none_for_red = (
        np.linalg.norm(seen(red, sight) - seen(green, sight))
        for sight in ("all receptors", "deuteranopia")
    )
    assert none_for_red < 0.5 * all_receptors
