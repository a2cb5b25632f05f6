"""The floor under the arm: a grid of lines that fades away from where the arm works."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from viser import SceneApi

from flexgui.stage.paint import AIM, Rgb

DEPTH = 0.32
"""How far the floor lies below the arm."""
RADIUS = 1.9
"""Of the lines around the place that is looked at; at its edge they are as the page's ground."""
LAST = 0.97
"""Of the radius: a line that only grazes the circle is left out."""
WIDTH, FADE = 8.0, 5.0
"""Of the shaded floor, and where its lines end. All but `LAST` are shares of the reach."""

FINEST = 0.25
"""Of the reach: lines are at most so far apart. Each costs a processor that draws the picture."""
ROUND = (5.0, 2.5, 1.0)
"""Times a power of ten, m: distances of lines that one can count by."""
PIECES = 4
"""Of a line: its colour goes straight from the beginning to the end of each."""
EVERY = 2
"""So many lines from one strong line to the next."""

LIGHT: tuple[Rgb, Rgb, Rgb] = ((230, 233, 237), (205, 210, 217), (255, 255, 255))
DARK: tuple[Rgb, Rgb, Rgb] = ((48, 53, 59), (72, 78, 86), (20, 20, 20))
"""Weak and strong lines, and the ground that they fade into."""

EXPOSURE = 0.6
"""Of three.js: light that is shown as it is."""

CELLS = 5
"""From one strong line of the shaded floor to the next."""


class Floor(Protocol):
    """What is under the arm."""

    def set_dark(self, dark: bool) -> None:
        """Lines that suit the page's ground."""

    def remove(self) -> None:
        """Takes it from the scene."""


def add_floor(scene: SceneApi, path: str, reach: float, dark: bool, fine: bool) -> Floor:
    """A shaded floor takes the arm's shadow; without a graphics card it costs half of the time
    that a picture takes, lines nearly nothing."""
    return (ShadedFloor if fine else LineFloor)(scene, path, reach, dark)


class ShadedFloor:
    """One large plane whose every pixel is computed."""

    def __init__(self, scene: SceneApi, path: str, reach: float, dark: bool) -> None:
        cell, strong, _ = DARK if dark else LIGHT
        size = cell_size(reach)
        self._grid = scene.add_grid(
            path, WIDTH * reach, WIDTH * reach, plane="xy", cell_size=size,
            section_size=CELLS * size, cell_color=cell, section_color=strong, shadow_opacity=0.14,
            fade_distance=FADE * reach, position=(0.0, 0.0, -DEPTH * reach),
        )  # fmt: skip

    def set_dark(self, dark: bool) -> None:
        """Take the colours of the dark or the light theme."""
        self._grid.cell_color, self._grid.section_color = (DARK if dark else LIGHT)[:2]

    def remove(self) -> None:
        """Take it out of the scene."""
        self._grid.remove()


class LineFloor:
    """Only the pixels of the lines are drawn."""

    def __init__(self, scene: SceneApi, path: str, reach: float, dark: bool) -> None:
        points, self._strength, self._strong = floor_lines(reach)
        self._lines = scene.add_line_segments(
            path, points, self._colours(dark), thickness=1.0, thickness_units="screen"
        )

    def set_dark(self, dark: bool) -> None:
        """Take the colours of the dark or the light theme."""
        self._lines.colors = self._colours(dark)

    def remove(self) -> None:
        """Take it out of the scene."""
        self._lines.remove()

    def _colours(self, dark: bool) -> np.ndarray:
        """(k, 2, 3) uint8"""
        cell, strong, ground = (light_of(colour) for colour in (DARK if dark else LIGHT))
        line = np.where(self._strong[:, None, None], strong, cell)
        mixed = ground + self._strength[:, :, None] * (line - ground)
        return np.asarray(np.round(255.0 * mixed), dtype=np.uint8)


def cell_size(reach: float) -> float:
    """m, a power of ten: where pixels are computed anyway, more lines cost nothing."""
    size = float(10.0 ** np.floor(np.log10(reach)))
    return size if size <= 0.25 * reach else size / 10.0


def spacing(reach: float) -> float:
    """m, a round number."""
    most = FINEST * reach
    power = float(10.0 ** np.floor(np.log10(most)))
    return next(r * power for r in ROUND if r * power <= most)


def floor_lines(reach: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (k, 2, 3) in m of the pieces of all lines, strength (k, 2) of their ends from 1 where
    the arm works to 0 at the edge, and which (k,) belong to a strong line."""
    size, radius = spacing(reach), RADIUS * reach
    middle = np.array(AIM[:2]) * reach
    share = np.linspace(-1.0, 1.0, PIECES + 1)
    pieces, strong = [], []
    for along in (0, 1):
        across = 1 - along
        first, last = np.ceil((middle[across] + LAST * radius * np.array([-1.0, 1.0])) / size)
        for number in np.arange(first, last):
            place = number * size
            half = np.sqrt(radius**2 - (place - middle[across]) ** 2)
            line = np.full((PIECES + 1, 3), -DEPTH * reach)
            line[:, along], line[:, across] = middle[along] + half * share, place
            pieces.append(np.stack([line[:-1], line[1:]], axis=1))
            strong.append(np.full(PIECES, number % EVERY == 0.0))
    points = np.concatenate(pieces)
    away = np.linalg.norm(points[:, :, :2] - middle, axis=2) / radius
    return points.astype(np.float32), np.clip(1.0 - away, 0.0, 1.0), np.concatenate(strong)


def light_of(colour: Rgb) -> np.ndarray:
    """(3,) from 0 to 1: the light of a point that is seen as this colour, greyish as it must be.

    viser takes points' colours as light, and shows light in the ACES filmic curve (three.js, after
    S. Hill) as sRGB (IEC 61966-2-1). White is out of its reach.
    """
    c = np.array(colour) / 255.0
    y = np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
    # y = (v^2 + a v - b) / (c v^2 + d v + e), solved for the exposed light v.
    square, linear = 1.0 - 0.983729 * y, 0.0245786 - 0.4329510 * y
    rest = 0.000090537 + 0.238081 * y
    v = (np.sqrt(linear**2 + 4.0 * square * rest) - linear) / (2.0 * square)
    return np.clip(EXPOSURE * v, 0.0, 1.0)
