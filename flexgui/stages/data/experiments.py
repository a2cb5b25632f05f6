"""Experiments to simulate: working points, excitation, length, noise, seed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexgui.core.recording.channels import is_reference
from flexgui.core.scenario.schema import Scenario
from flexgui.session.edit import Document, Edit, model_of


@dataclass(frozen=True)
class Experiments:
    """What the data stage asks for; the paper's seven working points by default."""

    first: float = math.pi / 8.0
    """rad"""
    last: float = 7.0 * math.pi / 8.0
    count: int = 7
    seconds: float = 3.0
    excitation: str = "prbs_balanced"
    amplitude: float = 0.3
    """rad/s"""
    seed: int = 1
    sweep: bool = True
    """Whether a validation sweep over the same range is made, without noise."""

    def edit(self, snr_db: float | None) -> Edit:
        """Puts these in the place of all simulated recordings; files stay."""
        entries = self._entries(snr_db)

        def change(document: Document) -> None:
            kept = [r for r in document.get("recordings", ()) if "simulate" not in r]
            names = {r.get("name") for r in kept}
            fresh = [r for r in entries if r["name"] not in names]
            document["recordings"] = [*fresh, *kept]

        return change

    def _entries(self, snr_db: float | None) -> list[dict[str, Any]]:
        common: dict[str, Any] = {
            "seconds": self.seconds, "excitation": self.excitation, "amplitude": self.amplitude,
        }  # fmt: skip
        noise = {} if snr_db is None else {"snr_db": snr_db}
        found: list[dict[str, Any]] = []
        for k, theta2 in enumerate(np.linspace(self.first, self.last, self.count)):
            simulate = {"theta2": round(float(theta2), 10), "seed": self.seed + k}
            found.append({"name": point_name(float(theta2)), "simulate": simulate | common | noise})
        if self.sweep and self.last > self.first:
            moving: dict[str, Any] = {
                "sweep": [round(self.first, 10), round(self.last, 10)], "seconds": 10.0,
                "excitation": "prbs", "seed": self.seed + 100,
            }  # fmt: skip
            found.append({"name": "sweep", "role": "validate", "simulate": moving})
        return found


def has_working_points(scenario: Scenario) -> bool:
    """Whether the rig can run the experiments offered: references, and a second joint to place."""
    model = model_of(scenario)
    references = model.drive.reference_channels(model.arm)
    follows = any(is_reference(name) for name in references)
    return model.arm.joints > 1 and follows and model.drive.torque_known


def point_name(theta2: float) -> str:
    """'θ2 = 3π/8', or in degrees where it is no eighth of π."""
    eighths = 8.0 * theta2 / math.pi
    if abs(eighths - round(eighths)) < 1e-6:
        whole = round(eighths)
        return "θ2 = π/8" if whole == 1 else f"θ2 = {whole}π/8"
    return f"θ2 = {math.degrees(theta2):.1f}°"
