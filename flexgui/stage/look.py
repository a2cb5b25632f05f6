"""Light, floor colours and a good place to look from."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import NamedTuple, Protocol

import numpy as np
from viser import SceneApi

ROOT = "/stage"

AIM = (0.40, 0.27, 0.04)
"""Where the viewer looks, in shares of the reach: an arm at work stands about there."""
LIFTED, TURNED = 0.74, 0.10
"""rad, of the eye above the plane of the arm and to the right of its -y direction."""
FIELD = 0.62
"""rad, vertical field of view; a narrow one keeps the pedestal upright."""
HALF_WIDTH, HALF_HEIGHT = 0.78, 0.60
"""In sight on either side of the aim, in shares of the reach."""

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


def view_of(reach: float, aspect: float) -> View:
    """From where an arm of that reach (m) fills a canvas `aspect` times as wide as it is high."""
    spread = np.tan(0.5 * FIELD)
    distance = reach * max(HALF_HEIGHT / spread, HALF_WIDTH / (spread * max(aspect, 0.2)))
    away = np.array([np.sin(TURNED), -np.cos(TURNED), 0.0]) * (np.cos(LIFTED) * distance)
    away[2] = np.sin(LIFTED) * distance
    aim = np.array(AIM) * reach
    return View(aim + away, aim, np.array([0.0, 0.0, 1.0]), FIELD)


def light(scene: SceneApi, fine: bool) -> None:
    """Fine light casts shadows and is reflected; plain light is quick without a graphics card."""
    scene.configure_default_lights(cast_shadow=fine)
    scene.configure_environment_map("warehouse" if fine else None)
    if not fine:
        # What no lamp reaches would be black without something to reflect.
        scene.add_light_ambient(f"{ROOT}_light", intensity=AMBIENT)
