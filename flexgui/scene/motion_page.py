"""A motion as one HTML file: the 3-D stage with play, seek and speed, without any network."""

from __future__ import annotations

import html
import math
import re
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import rich
import viser

from flexgui.core.trajectory import Trajectory
from flexgui.scene.arm_scene import ArmScene

FRAMES_PER_SECOND = 30.0
MOST_SECONDS = 10.0
"""About 1.5 MB; a longer motion is cut there, and `playback_note` says so."""
GRID_BITS = 13
"""Beams are drawn on a grid of the reach over two to this power: 0.12 mm of an arm of 1 m."""


def playback_html(
    motion: Trajectory, ghost: np.ndarray | None = None, exaggeration: float = 1.0
) -> str:
    """A page that plays the motion, its bending `exaggeration` times as large, with the measured
    postures `ghost` (N, n) where given.

    It is recorded by a server of its own on a free port of this machine, which is stated nowhere
    and which ends with the recording: writing a page ends recordings of the same server.
    """
    index = frame_indices(motion.time)
    with _private_server() as server:
        # Fine light leaves all but invisible until its image is decoded: 10 s in software.
        stage = ArmScene(server, motion.arm, motion.p, motion.q[0])
        stage.body.grid = 2.0 ** (math.ceil(math.log2(stage.body.reach)) - GRID_BITS)
        stage.exaggeration = exaggeration
        view, camera = stage.view(), server.initial_camera
        camera.position, camera.look_at, camera.fov = view.position, view.look_at, view.fov
        camera.up = view.up
        stage.show_paths(motion.q[index], None if ghost is None else ghost[index])
        recorder = server.get_scene_serializer()
        for i in index:
            stage.show(motion.q[i], None if ghost is None else ghost[i])
            recorder.insert_sleep(1.0 / FRAMES_PER_SECOND)
        return recorder.as_html()


@contextmanager
def _private_server() -> Iterator[viser.ViserServer]:
    """A server on loopback that prints nothing: viser greets and takes leave even if not verbose,
    on rich's common console."""
    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
        try:
            yield server
        finally:
            server.stop()
    finally:
        console.quiet = before


def frame_indices(time: np.ndarray) -> np.ndarray:
    """(k,) samples, of `time` (N,) in s, nearest to the frames' times, over at most
    MOST_SECONDS."""
    elapsed = np.asarray(time, dtype=float) - float(time[0])
    length = min(float(elapsed[-1]), MOST_SECONDS)
    times = np.arange(0.0, length + 0.5 / FRAMES_PER_SECOND, 1.0 / FRAMES_PER_SECOND)
    after = np.clip(np.searchsorted(elapsed, times), 1, len(elapsed) - 1)
    nearer = times - elapsed[after - 1] < elapsed[after] - times
    return np.unique(np.where(nearer, after - 1, after))


def playback_note(motion: Trajectory, exaggeration: float = 1.0) -> str:
    """One sentence on what is played, with its bending `exaggeration` times as large."""
    length = float(motion.time[-1] - motion.time[0])
    shown = f"the first {MOST_SECONDS:g} s" if length > MOST_SECONDS else f"{length:.3g} s"
    larger = "" if exaggeration == 1.0 else f"; the bending is drawn {exaggeration:g} times larger"
    # In quotes: as bare words some names read as a part of the sentence.
    arm = f'the arm "{motion.arm.name}"' if motion.arm.name else "the arm"
    return f"Motion of {arm}, {shown} at {FRAMES_PER_SECOND:g} frames/s{larger}."


def embedded(page: str, title: str) -> str:
    """An element of another page, which it cannot touch, and the page as a text beside it.

    The other page's script gives the text to the element; escaped as an attribute it were a fifth
    longer.
    """
    return (
        f'<iframe title="{html.escape(title, quote=True)}" sandbox="allow-scripts" '
        'style="width:100%;height:520px;border:0"></iframe>'
        f'<script type="text/plain" id="player">{ENDING.sub(ESCAPED, page)}</script>'
    )


ENDING, ESCAPED = re.compile(r"<(?=\\*(?:!--|/?script))", re.IGNORECASE), r"<\\"
"""What begins or ends a script element or a comment; report.js takes the backslash away."""
