"""The stage adds each node once and then only moves it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import viser

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.presets import presets
from flexgui.core.arm.slots import arm_vector
from flexgui.page.scene_panel import has_camera
from flexgui.scene.arm_scene import MOST_EXAGGERATION, ArmScene
from tests.helpers import ARMS, chain, random_state, with_modes
from tests.scene.test_view import in_sight

SINGLE = 1e-6
"""m: vertices are single precision."""

PER_FRAME = 60
"""Messages; viser splits an atomic block after 128, and each costs a browser time."""


@pytest.fixture(scope="module")
def server() -> Iterator[viser.ViserServer]:
    started = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield started
    started.stop()


@contextmanager
def messages(server: viser.ViserServer) -> Iterator[list[object]]:
    """All scene messages that are queued meanwhile."""
    found: list[object] = []
    original = server.scene._queue_scene_message

    def record(message: object) -> None:
        found.append(message)
        original(message)  # type: ignore[arg-type]

    server.scene._queue_scene_message = record  # type: ignore[assignment,method-assign]
    try:
        yield found
    finally:
        server.scene._queue_scene_message = original  # type: ignore[method-assign]


def added(found: list[object]) -> list[str]:
    return [m.name for m in found if hasattr(m, "props") and hasattr(m, "name")]


@pytest.fixture
def fresh(server: viser.ViserServer) -> Iterator[viser.ViserServer]:
    yield server
    server.scene.reset()


def stage_of(server: viser.ViserServer, name: str = "2-2") -> tuple[ArmScene, np.ndarray]:
    arm = ARMS[name]
    q, _ = random_state(arm, 1)
    return ArmScene(server, arm, arm_vector(arm), q), q


@pytest.mark.parametrize("name", ["one mode", "2-2", "slide", "ground", "3-3-3"])
def test_every_name_is_added_once(fresh: viser.ViserServer, name: str) -> None:
    with messages(fresh) as found:
        stage, q = stage_of(fresh, name)
        motion = np.array([q, 1.1 * q, 1.2 * q])
        stage.show_paths(motion, 1.05 * motion)
        for row in motion:
            stage.show(row, 1.05 * row)
        stage.exaggeration = 10.0
        stage.show_camera(False)
        stage.show(motion[0])
    names = added(found)
    assert len(names) == len(set(names))


def test_moving_adds_no_node_and_few_messages_and_standing_none(fresh: viser.ViserServer) -> None:
    stage, q = stage_of(fresh)
    stage.show(q, q)
    with messages(fresh) as found:
        stage.show(1.1 * q, 1.2 * q)
    assert not added(found)
    assert 0 < len(found) < PER_FRAME
    pose, tips = stage.body.pose(1.1 * q), stage.body.tip_points(np.array([1.1 * q, 1.2 * q]))
    for beam, vertices in zip(stage.model.beams, pose.beams, strict=True):
        assert np.abs(beam.vertices - vertices).max() < SINGLE
    assert np.allclose(stage.model.ends[-1].position, pose.tip.place)
    assert stage.paths.now.visible and np.abs(stage.paths.now.points[0] - tips).max() < SINGLE
    with messages(fresh) as found:
        stage.show(1.1 * q, 1.2 * q)
    assert not found


@pytest.mark.parametrize("other", [with_modes(2, 2), ARMS["3-3"], ARMS["slide"]])
def test_another_arm_of_the_same_joints_keeps_the_nodes(
    fresh: viser.ViserServer, other: Arm
) -> None:
    stage, q = stage_of(fresh)
    stage.show(q, q)
    stage.show_paths(q[None], q[None])
    stage.show_camera(False)
    old, posture = stage.model.beams[0].name, np.zeros(other.coordinates)
    posture[:2] = 0.5 * q[:2]
    with messages(fresh) as found:
        stage.rebuild(other, arm_vector(other), posture)
    assert old not in added(found)
    assert bool(added(found)) == (other is ARMS["slide"])
    assert stage.body.arm is other and stage.pose.coordinates == pytest.approx(posture[:2])
    assert not stage.paths.model.visible and not stage.camera.cross.visible


def test_the_ghost_is_hidden_until_it_is_known(fresh: viser.ViserServer) -> None:
    stage, q = stage_of(fresh)
    group = fresh.scene._handle_from_node_name["/stage/ghost"]
    assert not group.visible
    stage.show(q, q)
    assert group.visible
    stage.show(1.1 * q)
    assert not group.visible


def test_the_camera_moves_only_when_the_tip_leaves_its_picture(fresh: viser.ViserServer) -> None:
    stage, q = stage_of(fresh)
    before = stage.camera.frame.position.copy()
    q[0] += 0.01
    stage.show(q)
    assert np.array_equal(stage.camera.frame.position, before)
    q[0] += 1.0
    stage.show(q)
    assert np.allclose(stage.camera.frame.position[:2], stage.pose.tip.place[:2])


def test_anchors_are_nodes_of_the_scene_and_what_is_attached_goes(fresh: viser.ViserServer) -> None:
    stage, _ = stage_of(fresh)
    for place in ("base", "joint1", "origin2", "end1", "tip", "camera"):
        assert stage.anchor(place) in fresh.scene._handle_from_node_name
    node = fresh.scene.add_icosphere(f"{stage.anchor('joint2')}/friction", 0.02)
    stage.attach("friction", node)
    stage.detach("friction")
    assert node._impl.removed
    stage.detach("never there")


@pytest.mark.parametrize("aspect", [0.45, 1.0, 1.8])
def test_the_arm_is_in_sight(fresh: viser.ViserServer, aspect: float) -> None:
    """The first joint and the tip of a bent arm lie within the picture."""
    stage, _ = stage_of(fresh)
    q = np.zeros(ARMS["2-2"].coordinates)
    q[1] = 1.2
    stage.show(q)
    view = stage.view(aspect)
    for place in (stage.pose.joints[0].place, stage.pose.tip.place):
        assert in_sight(view, aspect, place)


def test_every_preset_can_be_shown(fresh: viser.ViserServer) -> None:
    for arm in (*presets().values(), chain(0, 0)):
        stage = ArmScene(fresh, arm, arm_vector(arm))
        stage.show(np.full(arm.coordinates, 0.01))
        fresh.scene.reset()


def test_exaggeration_stays_between_its_bounds(fresh: viser.ViserServer) -> None:
    stage, _ = stage_of(fresh)
    for wished, given in ((900.0, MOST_EXAGGERATION), (0.0, 1.0)):
        stage.exaggeration = wished
        assert stage.exaggeration == given


FILE, SIMULATED = SimpleNamespace(simulate=None), SimpleNamespace(simulate=object())


def session(columns: tuple[str, ...] | None, *specs: Any) -> Any:
    recording = None if columns is None else SimpleNamespace(has=lambda *n: set(n) <= set(columns))
    scenario = SimpleNamespace(recordings=specs)
    playback, document = SimpleNamespace(recording=recording), SimpleNamespace(scenario=scenario)
    return cast(Any, SimpleNamespace(playback=playback, document=document))


@pytest.mark.parametrize(
    ("columns", "specs", "drawn"),
    [
        (("theta1", "z1", "z2"), [FILE], True),
        (("theta1", "z1"), [FILE], False),
        (None, [SIMULATED, FILE], False),
        (None, [SIMULATED], True),
    ],
    ids=["camera", "no camera", "not read yet", "simulated"],
)
def test_what_the_recordings_hold_decides_whether_a_camera_is_drawn(
    columns: tuple[str, ...] | None, specs: list[Any], drawn: bool
) -> None:
    assert has_camera(session(columns, *specs)) == drawn
