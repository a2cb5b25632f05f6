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
    "a comparison": [
        colours.MEASURED, colours.MODEL, colours.RESIDUAL, colours.BESIDE, colours.FLOOR
    ],
    "an effect on the residual": [colours.RESIDUAL, colours.ADDED, colours.FLOOR],
    "an effect on an output": [colours.MEASURED, colours.START, colours.ADDED],
    "applied and missing torque": [colours.REFERENCE, colours.MISSING],
    "both ways of a joint": [colours.MISSING, colours.BACKWARDS, colours.ADDED],
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


OF_MEANING = {
    "measured": colours.MEASURED, "model": colours.MODEL, "residual": colours.RESIDUAL,
    "effect": colours.ADDED, "reference": colours.REFERENCE, "joint 1": colours.JOINTS[0],
    "joint 2": colours.JOINTS[1], "another model": colours.BESIDE, "context": colours.START,
}  # fmt: skip
GROUNDS = ("#ffffff", "#1a1b1e")
READABLE = 3.0
"""Contrast of graphics, WCAG 2.1."""


def luminance(colour: str) -> float:
    coded = np.array(colours.rgb(colour)) / 255.0
    light = np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)
    return float(light @ [0.2126, 0.7152, 0.0722])


def test_each_meaning_has_a_colour_of_its_own() -> None:
    for (one, first), (other, second) in combinations(OF_MEANING.items(), 2):
        distance = np.linalg.norm(seen(first, "all receptors") - seen(second, "all receptors"))
        assert distance >= 2.0 * APART, (one, other)


@pytest.mark.parametrize("ground", GROUNDS)
@pytest.mark.parametrize("what", OF_MEANING)
def test_colours_are_readable_on_a_light_and_on_a_dark_page(what: str, ground: str) -> None:
    lights = sorted(luminance(colour) + 0.05 for colour in (OF_MEANING[what], ground))
    assert lights[1] / lights[0] >= READABLE


def test_the_simulation_of_sight_merges_what_such_eyes_confuse() -> None:
    red, green = "#c00000", "#6a6a00"
    all_receptors, none_for_red = (
        np.linalg.norm(seen(red, sight) - seen(green, sight))
        for sight in ("all receptors", "deuteranopia")
    )
    assert none_for_red < 0.5 * all_receptors
