"""Forty-eight sets of recordings with what is on no list, or with nothing.

`python -m tests.programs.sample.unlisted FOLDER [words]` writes them and judges what a diagnosis
as of `flexgui export` says.

Two bending links in a velocity loop, four recordings of 3 s and a sweep that validates, plainly
stated. Twenty-four hide a law: six kinds, four of each; its size is drawn so that it moves the tip
of each recording by 5 to 100 times the camera's noise, rms. In eight somebody pushes the tip for .2
s, at another time in each recording. In eight nothing is hidden, in eight the camera's stand
vibrates.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tests.programs.mujoco.chain import mjcf
from tests.programs.mujoco.excitation import RATE_DECIMALS, SAMPLE
from tests.programs.mujoco.files import CAMERA_NOISE, ENCODER_NOISE, write_table
from tests.programs.mujoco.hidden_laws import HYSTERESIS, Instant, Law, Machine, Push
from tests.programs.mujoco.wide_arms import ARMS, references
from tests.programs.mujoco.wide_files import scenario_text
from tests.programs.sample.unlisted_judge import judged, line, summary

SEED = 91
STEP = 40e-6
"""s: the longest at which the chains are stable."""
SECONDS, REST = 3.0, 0.1
"""Of motion, and before it: a log begins before its motion."""
ROLES = ("estimate",) * 4 + ("validate",)
NAMES = tuple(f"posture{n}" for n in range(len(ROLES)))
UNSEEN = tuple(n for n, role in zip(NAMES, ROLES, strict=True) if role == "validate")
MIDDLES = ((-0.2, 0.9), (0.2, 1.3), (0.0, 1.1), (0.3, 1.5), (0.05, 1.15))
"""rad, about which the joints move."""
REACH, SLOW, SHAKEN = 0.5, (0.3, 0.55), 0.5
"""rad and Hz of the slow moves, and the share of the wide arms' references on top."""
SWEPT, SWEEP = 0.35, (0.2, 1.5)
"""rad and Hz of the recording that validates."""
SHOWN = (5.0, 100.0)
"""Times the camera's noise that a law moves the tip by, rms, in each recording."""
PUSH, FORCES = 0.2, (0.5, 8.0)
"""s and N"""
STAND_HZ, STAND_SIZES = (7.0, 23.0), (2e-4, 6e-4)
COLUMN = "temperature"
EACH, EIGHT = 4, 8


@dataclass(frozen=True)
class Case:
    """One set of recordings."""

    name: str
    arm: str
    law: Law | None = None
    pushes: tuple[Push, ...] = ()
    """One per recording."""
    stand: Mapping[str, float] = field(default_factory=dict)
    """hz, size in m and direction in rad."""

    @property
    def joints(self) -> int:
        return ARMS[self.arm].joints


def rates_asked(arm: str, number: int) -> tuple[np.ndarray, np.ndarray]:
    """First places (joints,) in rad, and the references (N, joints) in rad/s of a recording."""
    joints = ARMS[arm].joints
    rng = np.random.default_rng([SEED, number, *arm.encode()])
    t = SAMPLE * np.arange(round(SECONDS / SAMPLE) + 1)
    begin = np.clip(t / 0.5, 0.0, 1.0)[:, None]
    begin = begin**3 * (10.0 - 15.0 * begin + 6.0 * begin**2)
    phases = rng.uniform(0.0, 2.0 * np.pi, (joints, 2))
    if ROLES[number] == "validate":
        turned = 2.0 * np.pi * (SWEEP[0] * t + (SWEEP[1] - SWEEP[0]) * t**2 / (2.0 * SECONDS))
        way = SWEPT * np.sin(turned[:, None] + phases[:, 0])
    else:
        way = np.sin(2.0 * np.pi * np.array(SLOW) * t[:, None, None] + phases).sum(axis=2)
        way *= REACH / np.abs(way).max(axis=0)
    way = begin * way + np.array(MIDDLES[number][:joints])
    rates = np.diff(way, axis=0, append=way[-1:]) / SAMPLE
    rates += SHAKEN * references(ARMS[arm], number, SECONDS)
    still = np.zeros((round(REST / SAMPLE), joints))
    return way[0], np.round(np.vstack([still, rates]), RATE_DECIMALS)


def column_of(number: int) -> Callable[[float], float]:
    """The further column of a recording over the time in s: it drifts and swings about one."""
    rng = np.random.default_rng([SEED, 7, number])
    a, b, hz, phase = (rng.uniform(*x) for x in ((0.6, 1.4), (-0.2, 0.2), (0.15, 0.4), (0.0, 6.3)))
    return lambda t: float(a + b * t + 0.4 * np.sin(2.0 * np.pi * hz * t + phase))


def motion(case: Case, number: int) -> tuple[np.ndarray, list[Instant]]:
    """References (N, joints) and the true states of a recording."""
    start, rates = rates_asked(case.arm, number)
    push = case.pushes[number] if case.pushes else None
    text = mjcf(ARMS[case.arm].plant, STEP)
    machine = Machine(text, start, SAMPLE, case.law, column_of(number), push)
    return rates, [machine.sample(row) for row in rates]


def _tips(case: Case) -> np.ndarray:
    """(recordings, N, 2) m"""
    each = (motion(case, n)[1] for n in range(len(ROLES)))
    return np.array([[i.tip for i in instants] for instants in each])


def sized(case: Case, still: np.ndarray, rng: np.random.Generator) -> Case:
    """The case with a law whose size moves each recording's tip by a drawn multiple of the camera's
    noise; `still` are the tips without it."""
    law, factor, low, high = case.law, 1.0, 1.0, 1.0
    assert law is not None
    least, most = SHOWN
    share = rng.uniform(0.0, 1.0)
    for _ in range(4):
        law = replace(law, numbers={**law.numbers, "size": law.numbers["size"] * factor})
        case = replace(case, law=law)
        moved = np.sqrt(np.mean((_tips(case) - still) ** 2, axis=(1, 2))) / CAMERA_NOISE
        low, high = float(moved.min()), float(moved.max())
        wanted = least * (most / least * low / high) ** share
        if low >= least and high <= most and 0.8 < low / wanted < 1.25:
            break
        factor = wanted / low
    return case


Numbers = Mapping[str, float]


def _forms(
    low: float, high: float, rng: np.random.Generator
) -> dict[str, list[tuple[str, Numbers]]]:
    """Kind -> four forms with their numbers, for an angle between `low` and `high` in rad."""
    span = high - low

    def middle() -> float:
        return low + span * rng.uniform(0.3, 0.7)

    def bump(first: float, last: float) -> tuple[str, Numbers]:
        return "place_bump", {"middle": middle(), "width": span * rng.uniform(first, last)}

    powers = [("speed_power", {"power": p, "turns": t}) for p, t in
              ((0.5, 1.0), (2.0, 0.0), (3.0, 1.0), (1.5, 1.0))]  # fmt: skip
    return {
        "power": powers,
        "place": [bump(0.03, 0.06), bump(0.06, 0.1), bump(0.2, 0.3), bump(0.3, 0.5)],
        "friction": [("falling_friction", {"pace": rng.uniform(0.08, 0.3)}) for _ in range(EACH)],
        "product": [
            ("speeds_product", {}), ("speeds_product", {}),
            ("damping_over_other", {"middle": middle()}), ("load_damping", {}),
        ],
        "column": [("column_torque", {}), ("column_friction", {})] * 2,
        "hysteresis": [
            (HYSTERESIS, {"way": rng.uniform(0.03, 0.3), "power": p}) for p in (0.0, 2.0, 0.0, 2.0)
        ],
    }  # fmt: skip


OTHER = ("speeds_product", "damping_over_other")
"""Forms that read the other joint."""


def _ranges(arm: str) -> np.ndarray:
    """(2, joints) rad: least and largest angles of the estimation recordings."""
    ways = []
    for n, role in enumerate(ROLES):
        if role == "estimate":
            start, rates = rates_asked(arm, n)
            ways.append(start + SAMPLE * np.cumsum(rates, axis=0))
    return np.array([np.concatenate(ways).min(axis=0), np.concatenate(ways).max(axis=0)])


def cases() -> dict[str, Case]:
    """All by name; the size of a law is its first guess, in N m of a typical motion."""
    rng, found = np.random.default_rng(SEED), list[Case]()
    for n, arm in enumerate(("paper", "unequal")):
        low, high = _ranges(arm)
        targets = [int(rng.integers(2)) for _ in range(6 * EACH)]
        forms = [_forms(low[k], high[k], rng) for k in (0, 1)]
        for j, kind in enumerate(forms[0]):
            for i in range(n, EACH, 2):
                target = targets[EACH * j + i]
                form, numbers = forms[target][kind][i]
                carrier = 1 - target if form in OTHER else target
                if carrier != target and "middle" in numbers:
                    numbers = forms[carrier][kind][i][1]
                numbers = {"size": 0.3, **{k: float(f"{x:.4g}") for k, x in numbers.items()}}
                law = Law(form, target, carrier, numbers)
                found.append(Case(f"{kind}{i}_{arm}_joint{target + 1}", arm, law))
    return {case.name: case for case in (*found, *_others(rng))}


def _others(rng: np.random.Generator) -> Iterator[Case]:
    for n in range(EIGHT):
        pushes = []
        for _ in ROLES:
            force, angle = rng.uniform(*FORCES), rng.uniform(0.0, 2.0 * np.pi)
            at = float(f"{rng.uniform(0.4, SECONDS - 2.0 * PUSH):.4g}")
            pushes.append(Push(at, PUSH, (force * np.cos(angle), force * np.sin(angle))))
        yield Case(f"event{n}", ("paper", "unequal")[n % 2], pushes=tuple(pushes))
    yield from (Case(f"nothing{n}", ("paper", "unequal")[n % 2]) for n in range(EIGHT))
    for n in range(EIGHT):
        stand = {"hz": rng.uniform(*STAND_HZ), "size": rng.uniform(*STAND_SIZES),
                 "direction": rng.uniform(0.0, np.pi)}  # fmt: skip
        yield Case(f"stand{n}", ("paper", "unequal")[n % 2], stand=stand)


def written(case: Case, folder: Path) -> Path:
    """Recordings, the scenario that a newcomer would write, truth.json and truth.npz."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng([SEED, *case.name.encode()])
    if case.law is not None:
        case = sized(case, _tips(replace(case, law=None)), rng)
    arrays = dict[str, np.ndarray]()
    for number, name in enumerate(NAMES):
        rates, instants = motion(case, number)
        _write(case, number, rates, instants, folder, rng)
        for what in ("time", "angles", "rates", "tip", "share", "drive"):
            arrays[f"{name}/{what}"] = np.array([getattr(i, what) for i in instants])
        target = 0 if case.law is None else case.law.target
        arrays[f"{name}/law"] = np.array([i.law[target] for i in instants])
        arrays[f"{name}/column"] = np.array([column_of(number)(i.time) for i in instants])
    np.savez_compressed(folder / "truth.npz", **arrays)  # type: ignore[arg-type]
    (folder / "truth.json").write_text(json.dumps(asdict(case), indent=2) + "\n", encoding="utf-8")
    path = folder / "scenario.toml"
    text = scenario_text(ARMS[case.arm], ROLES)
    for name in NAMES:
        line = f'file = "{name}.csv.gz"\n'
        text = text.replace(line, line + f'columns = {{ input1 = "{COLUMN}" }}\n')
    path.write_text(text, encoding="utf-8")
    return path


def _write(
    case: Case, number: int, rates: np.ndarray, instants: Sequence[Instant], folder: Path,
    rng: np.random.Generator,
) -> None:  # fmt: skip
    angles, tip = np.array([i.angles for i in instants]), np.array([i.tip for i in instants])
    t = SAMPLE * np.arange(len(instants))
    if case.stand:
        wave = case.stand["size"] * np.sin(
            2.0 * np.pi * case.stand["hz"] * t + rng.uniform(0.0, 2.0 * np.pi)
        )
        angle = case.stand["direction"]
        tip = tip + np.outer(wave, [np.cos(angle), np.sin(angle)])
    angles = angles + ENCODER_NOISE * rng.standard_normal(angles.shape)
    tip = tip + CAMERA_NOISE * rng.standard_normal(tip.shape)
    column = np.array([column_of(number)(i.time) for i in instants])
    rows = np.hstack([t[:, None], rates, angles, tip, column[:, None]])
    numbers = range(1, case.joints + 1)
    columns = ("t", *(f"dtheta{k}_ref" for k in numbers), *(f"theta{k}" for k in numbers),
               "z1", "z2", COLUMN)  # fmt: skip
    decimals = (6, *[RATE_DECIMALS] * case.joints, *[7] * case.joints, 6, 6, 4)
    write_table(rows, folder / f"{NAMES[number]}.csv.gz", columns, decimals)


def _write_and_judge(name: str, folder: str, write_only: bool) -> dict[str, Any]:
    place = Path(folder) / name
    try:
        if not (place / "truth.json").exists():
            written(cases()[name], place)
        if write_only:
            return {"name": name, "failed": "only written"}
        return judged(place, UNSEEN)
    except Exception as e:  # one case must not end the others
        return {"name": name, "failed": f"{type(e).__name__}: {e}"}


def main() -> None:
    """Writes what is not there yet, judges, and prints a line for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("words", nargs="*", help="only cases whose names hold one of these")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--write-only", action="store_true")
    asked = parser.parse_intermixed_args()
    names = [n for n in cases() if any(word in n for word in asked.words or [""])]
    work = partial(_write_and_judge, folder=str(asked.folder), write_only=asked.write_only)
    records = list[dict[str, Any]]()
    with ProcessPoolExecutor(asked.workers, max_tasks_per_child=1) as pool:
        for done in as_completed([pool.submit(work, name) for name in names]):
            records.append(done.result())
            print(line(records[-1]), flush=True)
    print(summary(records))


if __name__ == "__main__":
    sys.exit(main())
