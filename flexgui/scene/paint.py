"""Light, floor, colours, small turns and a good place to look from, in the form that a scene takes
them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from typing import NamedTuple, Protocol

import numpy as np
from viser import GridHandle, LineSegmentsHandle, SceneApi, SceneNodeHandle

from flexgui.views import colours
from flexgui.views.colours import rgb

Rgb = tuple[int, int, int]

STEEL: Rgb = (92, 99, 109)
"""Hubs, pedestal, rails: they mean nothing."""
INK: Rgb = (66, 73, 83)
"""Flat marks; the light makes them paler."""
LINE: Rgb = (108, 116, 126)
"""Thin lines, which no light reaches; readable on a light and on a dark ground."""


MEASURED, MODEL = rgb(colours.MEASURED), rgb(colours.MODEL)
RESIDUAL, CONTEXT = rgb(colours.RESIDUAL), rgb(colours.START)


def about_vertical(angle: float) -> tuple[float, float, float, float]:
    """The quaternion wxyz of a turn by `angle` in rad about the vertical."""
    return float(np.cos(0.5 * angle)), 0.0, 0.0, float(np.sin(0.5 * angle))


def put(node: SceneNodeHandle, place: Sequence[float] | np.ndarray, angle: float) -> None:
    """Moves a node to a place (3,) in m and turns it by `angle` in rad about the vertical; what
    stays is not even compared by viser, whose own look for a change takes as long as all the
    rest."""
    if not np.array_equal(node.position, place):
        node.position = place  # type: ignore[assignment]
    turn = about_vertical(angle)
    if tuple(node.wxyz) != turn:
        node.wxyz = turn


def switch(node: SceneNodeHandle, visible: bool) -> None:
    """Shows or hides a node; nothing is sent where it is so."""
    if node.visible != visible:
        node.visible = visible


ROOT = "/stage"

AIM = (0.40, 0.27, 0.04)
"""Where the viewer looks, in shares of the reach: an arm at work stands about there."""
HOME, TOP, SIDE = "Home", "Top", "Side"
DIRECTIONS = {HOME: (0.74, 0.10), TOP: (1.56, 0.0), SIDE: (0.06, 0.0)}
"""rad, of the eye above the plane of the arm and to the right of its -y direction. From right above
the picture would have no upper edge."""
FIELD = 0.62
"""rad, vertical field of view; a narrow one keeps the pedestal upright."""
HALF_WIDTH, HALF_HEIGHT = 0.78, 0.60
"""In sight on either side of the aim, in shares of the reach."""

PICTURE_MARGIN = 0.25
"""Of the reach, around a motion that leaves the usual picture."""

FARTHEST = 3.0
"""Times the reach: rails and what slides on them lie within."""

AMBIENT = 1.6
"""Of the light from everywhere where nothing is reflected."""


class Owner(Protocol):
    """A viser server (one stage for all clients) or a client (its own)."""

    @property
    def scene(self) -> SceneApi:
        """The 3-D scene."""

    def atomic(self) -> AbstractContextManager[None]:
        """Hold all changes back until the block ends."""


class View(NamedTuple):
    """Where the viewer's eye stands, in m; `fov` in rad."""

    position: np.ndarray
    look_at: np.ndarray
    up: np.ndarray
    fov: float


def view_of(
    reach: float, aspect: float, side: str = HOME, places: np.ndarray | None = None
) -> View:
    """From where an arm of that reach (m) fills a canvas `aspect` times as wide as it is high.

    `side`: one of DIRECTIONS; `places` (k, 3) m of a motion are all in sight, also where the arm
    works elsewhere than around AIM. What no arm of that reach gets to, as where a model diverges,
    does not count.
    """
    spread = np.tan(0.5 * FIELD)
    aim, half = np.array(AIM) * reach, np.array([HALF_WIDTH, HALF_HEIGHT]) * reach
    places = None if places is None else places[np.linalg.norm(places, axis=1) < FARTHEST * reach]
    if (
        places is not None
        and len(places)
        and (np.abs(places - aim)[:, :2].max(axis=0) > half).any()
    ):
        low, high = places[:, :2].min(axis=0), places[:, :2].max(axis=0)
        aim[:2] = 0.5 * (low + high)
        half = np.maximum(half, 0.5 * (high - low) + PICTURE_MARGIN * reach)
    distance = max(half[1] / spread, half[0] / (spread * max(aspect, 0.2)))
    lifted, turned = DIRECTIONS[side]
    away = np.array([np.sin(turned), -np.cos(turned), 0.0]) * (np.cos(lifted) * distance)
    away[2] = np.sin(lifted) * distance
    return View(aim + away, aim, np.array([0.0, 0.0, 1.0]), FIELD)


def lowered(view: View, share: float) -> np.ndarray:
    """(3,) m to move eye and aim by, so that the aim stands in the middle of what a panel leaves
    that covers the lower `share` of the picture."""
    ahead = view.look_at - view.position
    distance = float(np.linalg.norm(ahead))
    right = np.cross(ahead / distance, view.up)
    up = np.cross(right / np.linalg.norm(right), ahead / distance)
    return -share * np.tan(0.5 * view.fov) * distance * up


def light(scene: SceneApi, fine: bool) -> None:
    """Fine light casts shadows and is reflected; plain light is quick without a graphics card."""
    scene.configure_default_lights(cast_shadow=fine)
    scene.configure_environment_map("warehouse" if fine else None)
    if not fine:
        # What no lamp reaches would be black without something to reflect.
        scene.add_light_ambient(f"{ROOT}_light", intensity=AMBIENT)


DEPTH = 0.32
"""How far the floor lies below the arm."""
RADIUS = 1.9
"""Of the lines around the place that is looked at; at its edge they are as the page's ground."""
LAST = 0.97
"""Of the radius: a line that only grazes the circle is left out."""
FLOOR_WIDTH, FLOOR_FADE = 8.0, 5.0
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


class Floor(NamedTuple):
    """What is under the arm."""

    node: GridHandle | LineSegmentsHandle
    set_dark: Callable[[bool], None]
    """Takes the colours of the dark or the light theme."""


def add_floor(scene: SceneApi, path: str, reach: float, dark: bool, fine: bool) -> Floor:
    """The floor of an arm with a `reach` in m. A fine one is a plane that takes its shadow; without
    a graphics card it costs half of the time that a picture takes, lines nearly nothing."""
    if fine:
        size = spacing(reach)
        grid = scene.add_grid(
            path, FLOOR_WIDTH * reach, FLOOR_WIDTH * reach, plane="xy", cell_size=size,
            section_size=EVERY * size, shadow_opacity=0.14, fade_distance=FLOOR_FADE * reach,
            position=(0.0, 0.0, -DEPTH * reach),
        )  # fmt: skip

        def colour_grid(dark: bool) -> None:
            grid.cell_color, grid.section_color = (DARK if dark else LIGHT)[:2]

        colour_grid(dark)
        return Floor(grid, colour_grid)
    points, strength, strong = floor_lines(reach)
    lines = scene.add_line_segments(
        path, points, line_colours(strength, strong, dark), thickness=1.0, thickness_units="screen"
    )

    def colour_lines(dark: bool) -> None:
        lines.colors = line_colours(strength, strong, dark)

    return Floor(lines, colour_lines)


def line_colours(strength: np.ndarray, strong: np.ndarray, dark: bool) -> np.ndarray:
    """(k, 2, 3) uint8 of the lines' ends, from `strength` (k, 2) and `strong` (k,) of
    `floor_lines`."""
    cell, section, ground = (light_of(colour) for colour in (DARK if dark else LIGHT))
    line = np.where(strong[:, None, None], section, cell)
    mixed = ground + strength[:, :, None] * (line - ground)
    return np.asarray(np.round(255.0 * mixed), dtype=np.uint8)


def spacing(reach: float) -> float:
    """m between lines, a round number, for a `reach` in m."""
    most = FINEST * reach
    power = float(10.0 ** np.floor(np.log10(most)))
    return next(r * power for r in ROUND if r * power <= most)


def floor_lines(reach: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (k, 2, 3) in m of the pieces of all lines for a `reach` in m, strength (k, 2) of their
    ends from 1 where the arm works to 0 at the edge, and which (k,) belong to a strong line."""
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
