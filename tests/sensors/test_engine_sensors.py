"""Sensors on links, against sites and hinges of a chain of rigid bodies in MuJoCo."""

from __future__ import annotations

import re
from functools import cache

import numpy as np
import pytest

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.mount import Mount
from flexgui.core.arm.segment import Segment
from flexgui.core.drives.velocity_loop import VelocityLoop
from flexgui.core.model import Model
from flexgui.core.sensors import sensor
from flexgui.core.simulate.motion import Task, at_rest
from flexgui.core.simulate.nonlinear import simulate_within

mujoco = pytest.importorskip("mujoco", reason="the independent engine is not installed")

from tests.programs.mujoco.chain import PAPER, Beam, Motor, Plant, mjcf  # noqa: E402

HINGES = 20
BEAMS = tuple(Beam(b.length, b.mass, b.EI, HINGES) for b in PAPER)
GAINS, GRAVITY = (60.0, 30.0), (0.0, -9.81)
POSTURE = (0.3, 0.9)
DAMPING = 1e-3
"""s: what swings at the start has gone where it is compared."""
DT, SECONDS, STEP = 1e-3, 3.0, 5e-5
COMPARED = slice(1000, 2990)
ONE_PER_CENT = 0.01
"""Of a channel's spread: bodies on hinges are no beam, and three shapes are not all of it."""

PLACES = {"acceleration1": 0.3, "acceleration2": 0.5, "gyro1": 0.2, "gyro2": 0.5}
"""m from the joint of the link in the name."""


def references() -> np.ndarray:
    """(N, 2) rad/s, smooth and from rest."""
    t = np.arange(round(SECONDS / DT)) * DT
    soft = 1.0 - np.exp(-((t / 0.3) ** 3))
    waves = np.column_stack([np.sin(2 * np.pi * 0.8 * t), np.cos(2 * np.pi * 1.3 * t)])
    return 0.5 * soft[:, None] * waves


def with_site(text: str, name: str, link: int, place: float) -> str:
    """The model's text with a site at `place` m from the root of a link (from 0)."""
    lengths, first = BEAMS[link].bodies, sum(len(b.bodies) for b in BEAMS[:link])
    body = int(np.searchsorted(np.cumsum(lengths), place - 1e-12))
    offset = place - sum(lengths[:body])
    opened = [m.end() for m in re.finditer(r"<body[^>]*>", text)][first + body]
    return f'{text[:opened]}<site name="{name}" pos="{offset!r} 0 0"/>{text[opened:]}'


@cache
def engine() -> dict[str, np.ndarray]:
    """Channel -> (N,): what the engine's gyroscopes read, accelerations along the links' normals by
    second differences of its sites, and strains 1 m from the neutral fibre.

    Its accelerometers read accelerations before the implicit step that damps the hinges: of a chain
    of light bodies they are mostly noise.
    """
    motors = tuple(Motor(gain) for gain in GAINS)
    text = mjcf(Plant(BEAMS, motors, gravity=GRAVITY, damping_time=DAMPING), STEP)
    lines = ""
    for name, place in PLACES.items():
        text = with_site(text, name, int(name[-1]) - 1, place)
        lines += f'<gyro name="{name}" site="{name}"/>'
    model = mujoco.MjModel.from_xml_string(
        text.replace("</mujoco>", f"<sensor>{lines}</sensor></mujoco>")
    )
    data = mujoco.MjData(model)
    joints = [int(model.joint(f"motor{k}").qposadr[0]) for k in (1, 2)]
    data.qpos[joints] = POSTURE
    read: dict[str, list[float]] = {n: [] for n in (*PLACES, "strain1", "strain2")}
    sites: dict[str, list[complex]] = {n: [] for n in (*PLACES, *(f"{n} normal" for n in PLACES))}
    for rates in references():
        data.ctrl[:] = rates
        mujoco.mj_forward(model, data)
        for name in PLACES:
            site = data.site(name)
            read[name].append(float(data.sensor(name).data[2]))
            sites[name].append(complex(*site.xpos[:2]))
            sites[f"{name} normal"].append(complex(site.xmat[1], site.xmat[4]))
        for k, beam in enumerate(BEAMS):
            bent = float(data.qpos[joints[k] + 1])
            read[f"strain{k + 1}"].append(-bent * HINGES / beam.length)
        mujoco.mj_step(model, data, round(DT / STEP))
    found = {name: np.array(values) for name, values in read.items()}
    for name in (n for n in PLACES if n.startswith("acceleration")):
        force = np.gradient(np.gradient(sites[name], DT), DT) - complex(*GRAVITY)
        found[name] = np.real(force * np.conj(sites[f"{name} normal"]))
    return found


@cache
def ours() -> dict[str, np.ndarray]:
    """The same of the simulator."""
    roots = {f"strain{k + 1}": Mount(place=b.length / HINGES / 2, distance=1.0)
             for k, b in enumerate(BEAMS)}  # fmt: skip
    mounts = {n: Mount(place=place) for n, place in PLACES.items()} | roots
    segments = tuple(Segment(length=b.length, mass=b.mass, EI=b.EI, modes=3, damping_time=DAMPING)
                     for b in BEAMS)  # fmt: skip
    arm = Arm(segments=segments, gravity=GRAVITY, mounts=tuple(mounts.items()))
    model = Model(arm, VelocityLoop(gains=GAINS), "nonlinear")
    signals, n = references(), arm.coordinates
    start = at_rest(np.array(POSTURE), n, 0)
    task = Task(np.arange(len(signals)) * DT, signals, start, start[None, :n])
    motion = simulate_within(model, model.numbers(), task, 1e-6).trajectory
    kinds = [sensor(kind) for kind in ("acceleration", "gyro", "strain")]
    return {c.name: s.measure(motion)[:, i] for s in kinds for i, c in enumerate(s.channels(arm))}


@pytest.mark.parametrize("channel", [*PLACES, "strain1", "strain2"])
def test_a_sensor_on_a_link_reads_what_that_of_the_engine_reads(channel: str) -> None:
    expected, found = (x[channel][COMPARED] for x in (engine(), ours()))
    assert np.std(found - expected) < ONE_PER_CENT * np.std(expected)
    assert abs(np.mean(found - expected)) < ONE_PER_CENT * np.sqrt(np.mean(expected**2))
