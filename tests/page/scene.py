"""Where a place of the scene stands on the screen."""

from __future__ import annotations

from typing import Any

import numpy as np


def on_screen(page: Any, camera: Any, place: np.ndarray) -> tuple[float, float]:
    """px of a place (3,) m, as the client's camera sees it in its canvas."""
    ahead = camera.look_at - camera.position
    ahead = ahead / np.linalg.norm(ahead)
    right = np.cross(ahead, camera.up_direction)
    right = right / np.linalg.norm(right)
    up, to = np.cross(right, ahead), place - camera.position
    spread = np.tan(0.5 * camera.fov) * (to @ ahead)
    boxes = [canvas.bounding_box() for canvas in page.locator("canvas").all()]
    box = max(boxes, key=lambda b: b["width"] * b["height"])
    x = 0.5 + 0.5 * (to @ right) / spread * box["height"] / box["width"]
    y = 0.5 - 0.5 * (to @ up) / spread
    return box["x"] + box["width"] * float(x), box["y"] + box["height"] * float(y)
