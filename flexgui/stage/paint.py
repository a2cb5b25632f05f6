"""Light, colours, small turns and a good place to look from, in the form that a scene takes
them."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import NamedTuple, Protocol

import numpy as np
from viser import SceneApi, SceneNodeHandle

from flexgui.views import colours

Rgb = tuple[int, int, int]

STEEL: Rgb = (92, 99, 109)
"""Hubs, pedestal, rails: they mean nothing."""
INK: Rgb = (66, 73, 83)
"""Flat marks; the light makes them paler."""
LINE: Rgb = (108, 116, 126)
"""Thin lines, which no light reaches; readable on a light and on a dark ground."""


def rgb(colour: str) -> Rgb:
    """'#rrggbb' as three integers."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


MEASURED, MODEL = rgb(colours.MEASURED), rgb(colours.MODEL)
RESIDUAL, ADDED, CONTEXT = rgb(colours.RESIDUAL), rgb(colours.ADDED), rgb(colours.START)


def about_vertical(angle: float) -> tuple[float, float, float, float]:
    """The quaternion wxyz of a turn in rad about the vertical."""
    return float(np.cos(0.5 * angle)), 0.0, 0.0, float(np.sin(0.5 * angle))


def put(node: SceneNodeHandle, place: Sequence[float] | np.ndarray, angle: float) -> None:
    """Moves a node to a place (3,) in m and turns it about the vertical; what stays is not even
    compared by viser, whose own look for a change takes as long as all the rest."""
    if not np.array_equal(node.position, place):
        node.position = place  # type: ignore[assignment]
    turn = about_vertical(angle)
    if tuple(node.wxyz) != turn:
        node.wxyz = turn


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

MARGIN = 0.25
"""Of the reach, around a motion that leaves the usual picture."""

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
    works elsewhere than around AIM.
    """
    spread = np.tan(0.5 * FIELD)
    aim, half = np.array(AIM) * reach, np.array([HALF_WIDTH, HALF_HEIGHT]) * reach
    if places is not None and len(places):
        aim, half = _around(places, aim, half, MARGIN * reach)
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


def _around(
    places: np.ndarray, aim: np.ndarray, half: np.ndarray, margin: float
) -> tuple[np.ndarray, np.ndarray]:
    """Aim (3,) m and half width and height (2,) m; as usual where that shows all the places."""
    away = np.abs(places[:, :2] - aim[:2]).max(axis=0)
    if (away <= half).all():
        return aim, half
    low, high = places[:, :2].min(axis=0), places[:, :2].max(axis=0)
    middle = np.array([*(0.5 * (low + high)), aim[2]])
    return middle, np.maximum(half, 0.5 * (high - low) + margin)


def light(scene: SceneApi, fine: bool) -> None:
    """Fine light casts shadows and is reflected; plain light is quick without a graphics card."""
    scene.configure_default_lights(cast_shadow=fine)
    scene.configure_environment_map("warehouse" if fine else None)
    if not fine:
        # What no lamp reaches would be black without something to reflect.
        scene.add_light_ambient(f"{ROOT}_light", intensity=AMBIENT)
