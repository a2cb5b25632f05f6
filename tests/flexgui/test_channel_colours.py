"""A channel has one colour in every figure, and its kind is told apart without colours."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.views import colours
from flexgui.views.colours import channel_colour, channel_edge

TOGETHER = ("z1", "z2", "theta1", "theta2", "deflection1", "deflection2", "u1", "u2")
SEVERAL = 0.05
"""Relative luminance by which two channels of one kind differ at least: one grey of a print."""


def luminance(colour: str) -> float:
    parts = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def test_channels_that_stand_together_have_colours_of_their_own() -> None:
    assert len({channel_colour(name) for name in TOGETHER}) == len(TOGETHER)


@pytest.mark.parametrize("kind", ["z", "u", "torque"])
def test_channels_of_one_kind_differ_in_lightness(kind: str) -> None:
    first, second = (luminance(channel_colour(f"{kind}{k}")) for k in (1, 2))
    assert abs(first - second) > SEVERAL


def test_a_joint_has_its_colour_whatever_is_measured_at_it() -> None:
    for k, colour in enumerate(colours.JOINTS[:2], start=1):
        assert channel_colour(f"theta{k}") == channel_colour(f"ydot{k}") == colour
        assert channel_edge(f"deflection{k}") == colour


def test_no_channel_looks_like_a_verdict() -> None:
    meanings = {colours.MODEL, colours.RESIDUAL, colours.ADDED, colours.BOUND}
    assert not meanings & {channel_colour(name) for name in TOGETHER}
