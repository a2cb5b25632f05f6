"""A challenge is made in a worker."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flexgui.core.progress import Progress


def hide(seed: int, level: str, folder: str, *, progress: Progress) -> tuple[str, str]:
    """(scenario as TOML, obfuscated truth); the recordings lie in `folder` afterwards."""
    from flexgui.core.recording.save import save_recording
    from flexgui.core.scenario.read import scenario_toml
    from flexgui.core.study.challenge import make_challenge

    progress.stage("Hiding an effect in an arm, and recording it")
    made = make_challenge(seed, level)
    for r in made.recordings:
        save_recording(r, Path(folder) / f"{r.name}.csv")
    return scenario_toml(made.scenario), made.obfuscated
