"""Light, colours, small turns and a good place to look from, in the form that scenes take them."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import NamedTuple, Protocol

import numpy as np
from viser import SceneApi, SceneNodeHandle

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

DEPTH = 0.32
"""Of the reach: how far the table lies below the arm."""


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


HIGH = 4.0
"""Times the reach."""


def drawn_late(vertices: np.ndarray, reach: float) -> np.ndarray:
    """(V + 2, 3) vertices (V, 3) of something translucent, and two that no face uses.

    What is translucent is drawn in the order of the middles of their vertices, the farthest first.
    These two put the middle above that of the table, which else would be drawn later and be missing
    behind.
    """
    low, high = (-HIGH * reach, -HIGH * reach, -DEPTH * reach), (HIGH * reach,) * 3
    return np.concatenate([vertices, np.array([low, high], dtype=vertices.dtype)])


LIGHT_FROM = (-0.45, -0.40, 1.0)
"""Direction towards the lamp: before the arm to the left, so that top, front and end differ."""
LAMP, FILL, SKY = 2.6, 0.9, 1.5
"""Intensities: of the lamp, of a weak one from the right, and of what comes from everywhere."""
GROUND: Rgb = (120, 128, 140)
"""Colour of the light from below."""


def light(scene: SceneApi, fine: bool) -> None:
    """Lamps that model a body. Fine light is reflected too, which is slow without a graphics
    card."""
    scene.configure_default_lights(enabled=False)
    scene.configure_environment_map("warehouse" if fine else None)
    share = 0.6 if fine else 1.0
    scene.add_light_directional(f"{ROOT}_lamp", intensity=share * LAMP, position=LIGHT_FROM)
    scene.add_light_directional(f"{ROOT}_fill", intensity=share * FILL, position=(1.0, -0.6, 0.5))
    scene.add_light_hemisphere(f"{ROOT}_sky", ground_color=GROUND, intensity=share * SKY)
