"""Deflection of the links' ends, as an angle."""

import numpy as np

from ..arm.arm import Arm
from ..arm.chord import chord_matrix
from ..drives.law import DriveLaw
from ..sensors.sensor import Channel, OutputRows, Sensor, rows_of
from ..trajectory import Trajectory


class LinkDeflection(Sensor):
    """Chord angle delta(l)/l of each bending segment's end, relative to its root. A gauge at the
    root shows the bending moment there instead: that is `strain`."""

    kind = "deflection"
    title = "link deflection"
    noise = "deflection_noise"
    letter, called = "g", "gauge"
    slow = True
    primary = True

    @staticmethod
    def _bending(arm: Arm) -> list[int]:
        return [k for k, modes in enumerate(arm.modes) if modes]

    def channels(self, arm: Arm) -> tuple[Channel, ...]:
        return tuple(Channel(f"deflection{k + 1}", "rad") for k in self._bending(arm))

    def measure(self, trajectory: Trajectory) -> np.ndarray:
        chord = chord_matrix(trajectory.arm, trajectory.p)[self._bending(trajectory.arm)]
        return trajectory.q @ chord.T

    def rows(self, arm: Arm, p: np.ndarray, law: DriveLaw) -> OutputRows:
        bending = self._bending(arm)
        rows = rows_of(arm, law, len(bending))
        rows.Q[:, :] = chord_matrix(arm, p)[bending]
        return rows
