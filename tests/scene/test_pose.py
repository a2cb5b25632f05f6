"""The drawn arm stands where the simulated one stands."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.presets import presets
from flexgui.core.arm.segment import Segment
from flexgui.core.arm.slots import arm_vector
from flexgui.scene.arm_geometry import RIGID, STATIONS, STRIP, beam_faces
from flexgui.scene.pose import RAIL, STACK, Body, mark_faces
from tests.helpers import ARMS, EVERY_ARM, PAPER, compiled, random_state, straight

SAME_PLACE = 1e-12
"""m: one formula, two orders of summing."""

SECOND_ORDER = 2e-4
"""Relative to the length, at slopes of about 0.1: what third-order terms leave."""

SINGLE = 1e-6
"""m: vertices are sent in single precision."""

UNCHANGED_LENGTH = 2e-3
"""Relative: chords between the stations instead of the line."""


def volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    """Enclosed volume; positive where all faces look outward."""
    a, b, c = (vertices[faces[:, i]].astype(float) for i in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", EVERY_ARM)
def test_the_tip_is_the_simulators(name: str, seed: int) -> None:
    arm = ARMS[name]
    p, (q, _) = arm_vector(arm), random_state(arm, seed)
    expected = compiled(arm).tip_place(q, p)[0]
    assert np.abs(Body(arm, p).pose(q).tip.place[:2] - expected).max() < SAME_PLACE


@pytest.mark.parametrize("name", ["2-2", "slide", "0-2-1"])
def test_many_tips_at_once_are_the_tips_one_by_one(name: str) -> None:
    arm = ARMS[name]
    body = Body(arm, arm_vector(arm))
    q = np.array([random_state(arm, seed)[0] for seed in range(5)])
    for exaggeration in (1.0, 20.0):
        tips = body.tip_points(q, exaggeration)
        ones = [body.pose(row, exaggeration).tip.place for row in q]
        assert np.abs(tips - np.array(ones)).max() < SINGLE


def test_exaggeration_begins_without_a_jump() -> None:
    arm = ARMS["3-3"]
    body, (q, _) = Body(arm, arm_vector(arm)), random_state(arm, 1, bend=0.02)
    true, next_to_it = body.pose(q).tip.place, body.pose(q, 1.0 + 1e-9).tip.place
    assert np.abs(true - next_to_it).max() < SECOND_ORDER * body.reach


def test_exaggeration_moves_no_joint_and_no_rigid_arm() -> None:
    arm = ARMS["0-2-1"]
    body, (q, _) = Body(arm, arm_vector(arm)), random_state(arm, 1)
    small, large = body.pose(q), body.pose(q, 50.0)
    assert small.coordinates == large.coordinates
    assert np.allclose(small.ends[0].place, large.ends[0].place)
    rigid = straight(q[: arm.joints], arm)
    assert np.allclose(body.pose(rigid).tip.place, body.pose(rigid, 50.0).tip.place)


def test_an_exaggerated_beam_keeps_its_length() -> None:
    arm = ARMS["2-2"]
    body, (q, _) = Body(arm, arm_vector(arm)), random_state(arm, 2)
    for link, length in zip(body.geometry.links(q[None], 50.0), body.geometry.lengths, strict=True):
        steps = np.linalg.norm(np.diff(link.line[0], axis=0), axis=1)
        assert steps.sum() <= length * (1.0 + SAME_PLACE)
        assert steps.sum() == pytest.approx(length, rel=0.2)
    gentle = body.geometry.links(q[None], 3.0)[0].line[0]
    arc = np.linalg.norm(np.diff(gentle, axis=0), axis=1).sum()
    assert arc == pytest.approx(body.geometry.lengths[0], rel=UNCHANGED_LENGTH)


def test_a_beam_has_the_real_section() -> None:
    """Width d of the paper's arm: a bar of 0.5 m x 5 cm x 5 cm."""
    body = Body(PAPER, arm_vector(PAPER))
    vertices = body.pose(np.zeros(PAPER.coordinates)).beams[0]
    assert np.ptp(vertices, axis=0) == pytest.approx([0.5, 0.05, 0.05], abs=SINGLE)
    assert volume(vertices, beam_faces()) == pytest.approx(0.5 * 0.05**2, rel=1e-5)


def test_beams_whose_section_is_unknown_get_one_that_can_be_seen() -> None:
    arm = presets()["two_stage_bench"]
    for section, segment in zip(Body(arm, arm_vector(arm)).sections, arm.segments, strict=True):
        assert tuple(section) == pytest.approx([s * segment.length for s in STRIP])
    rigid = Arm(segments=(Segment(length=0.4, mass=1.0, modes=0),))
    assert tuple(Body(rigid, arm_vector(rigid)).sections[0]) == pytest.approx(
        [s * 0.4 for s in RIGID]
    )


def test_faces_name_every_vertex_once_or_more() -> None:
    assert set(beam_faces().ravel()) == set(range(8 * STATIONS + 8))
    body = Body(ARMS["1-1"], arm_vector(ARMS["1-1"]))
    mark = body.marks(body.pose(np.zeros(ARMS["1-1"].coordinates)))[0]
    assert set(mark_faces().ravel()) == set(range(len(mark.vertices)))


def test_marks_tell_angles_in_degrees_and_slides_in_metres() -> None:
    arm = ARMS["slide"]
    body, q = Body(arm, arm_vector(arm)), np.zeros(arm.coordinates)
    q[:2] = [-0.25, np.pi / 6.0]
    assert [mark.text for mark in body.marks(body.pose(q))] == ["q₁ = −0.250 m", "θ₂ = 30.0°"]


def test_a_rail_lies_along_the_slide_and_stays_when_the_joint_moves() -> None:
    arm = ARMS["slide"]
    body, q = Body(arm, arm_vector(arm)), np.zeros(arm.coordinates)
    ends = body.rail_ends(body.pose(q))
    q[0] = 0.1
    moved = body.pose(q)
    assert np.array_equal(ends, body.rail_ends(moved))
    along, way = ends[1] - ends[0], moved.joints[0].place - body.pose(0.0 * q).joints[0].place
    assert np.linalg.norm(along) == pytest.approx(RAIL * body.reach)
    assert np.linalg.norm(np.cross(along, way)) == pytest.approx(0.0, abs=SAME_PLACE)
    turns = Body(ARMS["1-1"], arm_vector(ARMS["1-1"]))
    assert not turns.rail_ends(turns.pose(np.zeros(ARMS["1-1"].coordinates)))


def test_an_arc_spans_the_joints_angle() -> None:
    """From the direction of the segment before to that of the segment itself."""
    arm = ARMS["1-1"]
    body, (q, _) = Body(arm, arm_vector(arm)), random_state(arm, 4)
    pose = body.pose(q)
    rim = body.marks(pose)[1].vertices[:33, :2] - pose.joints[1].place[:2]
    directions = np.unwrap(np.arctan2(rim[:, 1], rim[:, 0]))
    assert directions[-1] - directions[0] == pytest.approx(q[1], abs=1e-5)
    turned = directions[-1] - pose.joints[1].angle
    assert np.cos(turned) == pytest.approx(1.0, abs=1e-6)


def test_uncoupled_segments_are_drawn_one_above_another() -> None:
    arm = presets()["two_stage_uncoupled"]
    body = Body(arm, arm_vector(arm))
    pose = body.pose(np.zeros(arm.coordinates))
    assert pose.joints[1].place[2] == pytest.approx(STACK * body.reach)
    assert np.allclose(pose.joints[1].place[:2], 0.0)


@pytest.mark.parametrize("size", [1e-12, 0.01, 0.1])
def test_the_text_of_a_joint_that_swings_about_zero_stays(size: float) -> None:
    body = Body(PAPER, arm_vector(PAPER))
    places = []
    for angle in (-size, size):
        q = np.zeros(PAPER.coordinates)
        q[0] = angle
        places.append(body.marks(body.pose(q))[0].label)
    assert np.abs(places[0] - places[1]).max() < SAME_PLACE
