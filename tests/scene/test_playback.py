"""A motion becomes one page that needs nothing else."""

from __future__ import annotations

import base64
import re

import msgspec
import numpy as np
import pytest
import viser
import zstandard

from flexgui.core.arm.slots import arm_vector
from flexgui.core.trajectory import Trajectory
from flexgui.scene.arm_scene import ArmScene
from flexgui.scene.motion_page import (
    FRAMES_PER_SECOND,
    MOST_SECONDS,
    embedded,
    frame_indices,
    playback_html,
    playback_note,
)
from tests.helpers import ARMS, compiled, random_state

LARGEST = 6e6
"""Characters: the viewer itself takes two thirds of that."""


def motion(seconds: float = 0.5, rate: float = 1000.0) -> Trajectory:
    arm = ARMS["2-2"]
    time = np.arange(int(seconds * rate) + 1) / rate
    q, _ = random_state(arm, 1)
    moved = q * (1.0 + 0.1 * np.sin(8.0 * time))[:, None]
    zero = np.zeros_like(moved)
    return Trajectory(arm, compiled(arm), arm_vector(arm), time, moved, zero, zero[:, :2])


def test_frames_are_a_thirtieth_of_a_second_apart() -> None:
    time = 3.0 + np.arange(2001) * 1e-3
    index = frame_indices(time)
    assert np.diff(time[index]) == pytest.approx(1.0 / FRAMES_PER_SECOND, abs=1.1e-3)
    assert index[0] == 0
    assert np.array_equal(frame_indices(np.arange(5) * 0.2), np.arange(5)), "a slow recording"


def test_a_long_motion_is_cut_and_the_note_says_so() -> None:
    long = motion(MOST_SECONDS + 3.0, 100.0)
    index = frame_indices(long.time)
    assert long.time[index[-1]] == pytest.approx(MOST_SECONDS, abs=0.02)
    assert "the first 10 s" in playback_note(long)
    assert "5 times larger" in playback_note(long, 5.0)


def test_the_page_needs_no_network_and_prints_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    short = motion()
    page = playback_html(short, ghost=1.01 * short.q)
    assert "__VISER_EMBED_DATA__" in page
    assert not re.search(r"<(?:script|link|img)[^>]+(?:src|href)=[\"']?https?:", page)
    assert len(page) < LARGEST
    assert capsys.readouterr().out == ""


def test_no_light_waits_for_an_image_and_leaves_the_picture_pale() -> None:
    """viser shows a picture at an opacity of 0.05 until such an image has come."""
    found = re.search(r'__VISER_EMBED_DATA__="([^"]+)"', playback_html(motion(0.1)))
    assert found is not None
    packed = base64.b64decode(found[1])
    size = int.from_bytes(packed[:8], "little")
    inside = zstandard.ZstdDecompressor().decompress(packed[8:], max_output_size=size)
    scene = msgspec.msgpack.decode(inside[8 : 8 + int.from_bytes(inside[:8], "little")])
    lights = [m for _, m in scene["messages"] if m["type"] == "EnvironmentMapMessage"]
    assert lights and all(m["hdri_data"] is None for m in lights)


def test_a_live_server_does_not_notice() -> None:
    live = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        arm = ARMS["2-2"]
        stage = ArmScene(live, arm, arm_vector(arm))
        recorder = live.get_scene_serializer()
        playback_html(motion(0.1))
        stage.show(random_state(arm, 2)[0])
        recorder.insert_sleep(0.1)
        assert len(recorder.serialize()) > 0
    finally:
        live.stop()


def test_an_embedded_page_cannot_break_out() -> None:
    page = '<b title="x">&</b></SCRIPT><script><!-- <\\script'
    text = embedded(page, 'a "title"')
    assert text.count("<script") == text.count("</script") == 1
    assert "<!--" not in text and "</SCRIPT" not in text
    assert 'sandbox="allow-scripts"' in text and 'title="a &quot;title&quot;"' in text
