"""What the scene draws of a recording: how much larger the bending, whether a camera, and the words
for it."""

from __future__ import annotations

from flexgui.session import Session
from flexgui.session.state import Live

BEFORE = Live().exaggeration
"""Where the slider stands until somebody moves it."""


def plays(session: Session) -> bool:
    """Whether the scene shows the recording and not the arm of the sliders."""
    return session.stage != "Arm" and session.playback is not None


def exaggeration(session: Session) -> float:
    """Of what the scene shows now."""
    chosen, motion = session.live.exaggeration, session.playback
    if motion is None or not plays(session) or chosen != BEFORE:
        return chosen
    return motion.exaggeration


def has_camera(session: Session) -> bool:
    """Whether a camera is drawn: only where the recording holds what one saw. What a file holds is
    not known before it was read; simulated recordings have a camera."""
    if session.recording is not None:
        return session.recording.has("z1", "z2")
    return all(spec.simulate is not None for spec in session.scenario.recordings)


def legend(session: Session) -> str:
    """What is what in the scene, in words; empty where it shows no recording."""
    motion = session.playback
    if motion is None or not plays(session):
        return ""
    arms = () if motion.ghost is None else (
        "Solid: model.", "Translucent: measured.", "Line at the tip: error."
    )  # fmt: skip
    factor = exaggeration(session)
    bends = motion.arm.coordinates > motion.arm.joints
    bending = f"Bending drawn ×{factor:g}." if factor > 1.0 else "Bending drawn as it is."
    larger = motion.ghost is not None and session.cursor.error > 1.0
    error = (f"Error drawn ×{session.cursor.error:g}.",) if larger else ()
    return " ".join((*arms, *((bending,) if bends else ()), *error))
