"""Strain gauges on bending links."""

import numpy as np

from ..arm.arm import Arm
from ..arm.point_motion import curvature_row
from ..drives.law import DriveLaw
from ..sensors.link_sensor import LinkSensor, families
from ..sensors.sensor import OutputRows, rows_of
from ..trajectory import Trajectory


class Strain(LinkSensor):
    """Strain -h delta''(x) of a beam's surface, h from its neutral fibre and x from its joint: what
    the bending moment there is over EI/h, mostly that at the root."""

    kind = "strain"
    title = "strain gauges"
    noise = "strain_noise"
    letter, called = "s", "strain gauge"
    slow = True
    on_bending_links = True
    at_end = False
    columns = families("strain", "", "strain of a link (gauge)")

    def gain_unit(self, arm: Arm, channel: str) -> str | None:
        """Without a stated distance the gain is this distance."""
        return None if self._distance(arm, channel) else "m"

    def _distance(self, arm: Arm, channel: str) -> float | None:
        mount = dict(arm.mounts).get(channel)
        return None if mount is None else mount.distance

    def _rows(self, arm: Arm, p: np.ndarray) -> np.ndarray:
        return np.array(
            [
                -(mount.distance or 1.0) * curvature_row(arm, p, k, x)
                for k, x, mount in self.places(arm, p)
            ]
        ).reshape(len(self.channels(arm)), arm.coordinates)

    def measure(self, trajectory: Trajectory) -> np.ndarray:
        return np.asarray(trajectory.q @ self._rows(trajectory.arm, trajectory.p).T)

    def rows(self, arm: Arm, p: np.ndarray, law: DriveLaw) -> OutputRows:
        rows = rows_of(arm, law, len(self.channels(arm)))
        rows.Q[:, :] = self._rows(arm, p)
        return rows
