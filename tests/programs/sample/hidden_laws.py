"""Recordings with laws that no catalogue has.

`python -m tests.programs.sample.hidden_laws FOLDER [words]`.

Each case becomes a folder with recordings, the scenario that a newcomer would write for them, and
the truth: words in truth.json, arrays along the motion in truth.npz.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from tests.programs.mujoco.chain import mjcf
from tests.programs.mujoco.excitation import RATE_DECIMALS, SAMPLE
from tests.programs.mujoco.files import CAMERA_NOISE, ENCODER_NOISE, write_table
from tests.programs.mujoco.hidden_laws import Instant, Machine, camera_bend, rigid_text
from tests.programs.mujoco.wide_arms import ARMS, STEP, references
from tests.programs.mujoco.wide_files import scenario_text as bending_text
from tests.programs.sample.hidden_drawn import (
    CAMERA,
    MIDDLES,
    RIG,
    ROLES,
    SECONDS,
    Case,
    cases,
    intended,
)
from tests.programs.sample.torque_rigs import FEEDBACK, WRONG_MASS
from tests.programs.sample.torque_rigs import scenario_text as torque_text

SHAKEN = 0.5
"""Of the wide arms' references in rad/s."""
RIGID_STEP = 4e-5
"""s. Noise alone is then 0.99 floors of the torque: the step is not seen."""
FIDELITY = 3e-5
"""Of a spread of some decimetres a third of the camera's noise: what a chain of ten hinges and
three shapes differ by. Noise alone is then 0.9 to 1.1 floors; the default, made for rigs, would
allow ten times as much as these instruments see."""
WORDS: Mapping[str, tuple[str, str, str]] = {
    "range_friction": ("dry friction in a range of angles only", "theta", "sign"),
    "cogging": ("cogging with three harmonics", "theta", ""),
    "other_joint": ("a push that depends on the other joint's angle", "theta", ""),
    "dead_zone_spring": ("a spring with a dead zone", "theta", ""),
    "quadratic_friction": ("quadratic friction", "dtheta", "sign"),
    "settling_friction": ("dry friction that rises and settles", "t", "sign"),
    "growing_friction": ("dry friction that grows with the time", "t", "sign"),
    "cable": ("a cable that pulls on one side", "theta", ""),
    "hysteresis": ("friction whose direction turns over a way", "theta", "way"),
    "place_viscous": ("viscous friction that grows along the way", "theta", "rate"),
    "exponential_spring": ("an end stop that grows exponentially", "theta", ""),
    "directed_friction": ("dry friction that depends on place and direction", "theta", "sign"),
    CAMERA: ("a camera whose scale changes over the place", "z", ""),
}
"""Form -> title, the variable that carries it, and how it follows the direction of motion: with its
sign, over a way, as a factor of the rate, or not at all."""


def recorded(case: Case, number: int) -> tuple[np.ndarray, list[Instant], np.ndarray]:
    """One recording as the instruments report it (N, columns), the true states, and what the
    camera reads too much (N, 2) in m."""
    rng = np.random.default_rng([number, *case.name.encode()])
    run = _torque_driven if case.arm == "rigid" else _looped
    instants, told, encoders = run(case, number, rng)
    added = _misread(case, instants, rng)
    rows = [SAMPLE * np.arange(len(told))[:, None], told, encoders]
    if case.arm != "rigid":
        tip = np.array([i.tip for i in instants]) + added
        rows.append(tip + CAMERA_NOISE * rng.standard_normal(tip.shape))
    return np.hstack(rows), instants, added


Run = tuple[list[Instant], np.ndarray, np.ndarray]
"""True states, what the drive was told, and the encoders."""


def _looped(case: Case, number: int, rng: np.random.Generator) -> Run:
    arm = ARMS[case.arm]
    t, way, _ = intended(case.arm, number)
    rates = np.diff(way, axis=0, append=way[-1:]) / SAMPLE
    rates += SHAKEN * references(arm, number, SECONDS)
    told = np.round(rates, RATE_DECIMALS)
    machine = Machine(mjcf(arm.plant, STEP), way[0], SAMPLE, case.law)
    instants = [machine.sample(row) for row in told]
    angles = np.array([i.angles for i in instants])
    return instants, told, angles + ENCODER_NOISE * rng.standard_normal(angles.shape)


def _torque_driven(case: Case, number: int, rng: np.random.Generator) -> Run:
    """Torques of a model that is ten per cent off and a feedback from the counting encoders."""
    _, way, speed = intended(case.arm, number)
    asked = np.gradient(speed, SAMPLE, axis=0)
    machine = Machine(rigid_text(RIG.masses, RIG.lengths, RIGID_STEP), way[0], SAMPLE, case.law)
    inertia = WRONG_MASS * np.diag(RIG.inertia(np.array(MIDDLES[number])))
    instants, told, encoders = list[Instant](), [], [way[0]]
    for i in range(len(way)):
        counts = machine.angles / RIG.step + RIG.counts * rng.standard_normal(RIG.joints)
        seen = RIG.step * np.round(counts)
        rate = (seen - encoders[-1]) / SAMPLE if i else np.zeros(RIG.joints)
        error, late = way[i] - seen, speed[i] - rate
        torque = inertia * (asked[i] + FEEDBACK**2 * error + 2.0 * FEEDBACK * late)
        told.append(np.round(torque, 6))
        encoders.append(seen)
        instants.append(machine.sample(told[-1]))
    return instants, np.array(told), np.array(encoders[1:])


def _misread(case: Case, instants: Sequence[Instant], rng: np.random.Generator) -> np.ndarray:
    """(N, 2) m, of a bent scale and a stand that vibrates from the start on."""
    added, tip = np.zeros((len(instants), 2)), np.array([i.tip for i in instants])
    if case.camera:
        k = int(case.camera["axis"])
        numbers = {name: x for name, x in case.camera.items() if name != "axis"}
        added[:, k] = camera_bend(tip[:, k], **numbers)
    if case.stand:
        s, t = case.stand, np.array([i.time for i in instants])
        phase = rng.uniform(0.0, 2.0 * np.pi)
        wave = s["size"] * np.exp(-s["decay"] * t) * np.sin(2.0 * np.pi * s["hz"] * t + phase)
        added += np.outer(wave, [np.cos(s["direction"]), np.sin(s["direction"])])
    return added


def scenario_text(case: Case) -> str:
    """What a newcomer states: arm, drive, noise, what stands firm; nothing of what is hidden."""
    tolerance = f"[diagnose]\nfidelity = {FIDELITY!r}\n"
    stated = "\n[rig]\nlevel = true\nrigid_base = true\ndirect_drive = true\n"
    if case.arm == "rigid":
        noise = float(f"{RIG.step * np.sqrt(RIG.counts**2 + 1.0 / 12.0):.3g}")
        text = torque_text(replace(RIG, recordings=0)).replace("[diagnose]\n", tolerance)
        for n, role in enumerate(ROLES):
            text += f'\n[[recordings]]\nfile = "posture{n}.csv.gz"\nrole = "{role}"\n'
        return text + f"\n[sensors]\nencoder_noise = {noise!r}  # rad\n" + stated
    arm = ARMS[case.arm]
    text = bending_text(replace(arm, modes=case.modes or arm.modes), ROLES)
    text = text.replace("[diagnose]\n", tolerance)
    noise_table = (
        f"camera_noise = {CAMERA_NOISE!r}  # m\nencoder_noise = {ENCODER_NOISE!r}  # rad\n"
    )
    return text + f"\n[sensors]\n{noise_table}" + stated


def written(case: Case, folder: Path) -> Path:
    """Recordings, scenario and truth as files; the scenario's path."""
    folder.mkdir(parents=True, exist_ok=True)
    numbers, rigid = range(1, case.joints + 1), case.arm == "rigid"
    told = [f"u{k}" if rigid else f"dtheta{k}_ref" for k in numbers]
    columns = ("t", *told, *(f"theta{k}" for k in numbers), *(() if rigid else ("z1", "z2")))
    decimals = (6, *[6] * case.joints, *[9 if rigid else 7] * case.joints, 6, 6)[: len(columns)]
    arrays = dict[str, np.ndarray]()
    for number in range(len(ROLES)):
        rows, instants, added = recorded(case, number)
        write_table(rows, folder / f"posture{number}.csv.gz", columns, decimals)
        along = _along(case, instants, added)
        arrays |= {f"posture{number}/{name}": array for name, array in along.items()}
    np.savez_compressed(folder / "truth.npz", **arrays)  # type: ignore[arg-type]
    (folder / "truth.json").write_text(json.dumps(said(case), indent=2) + "\n", encoding="utf-8")
    path = folder / "scenario.toml"
    path.write_text(scenario_text(case), encoding="utf-8")
    return path


def _along(case: Case, instants: Sequence[Instant], added: np.ndarray) -> dict[str, np.ndarray]:
    """Arrays of the truth, rows are samples: s, rad, rad/s, m, N m. `law` (N,) is what the target
    gets: N m that a joint is pushed with, or m that a reading is too large by."""
    names = ("time", "angles", "rates", "tip", "share", "drive")
    found = {name: np.array([getattr(i, name) for i in instants]) for name in names}
    law = np.zeros(len(instants))
    if case.law is not None:
        law = np.array([i.law[case.law.target] for i in instants])
    if case.camera:
        law = added[:, int(case.camera["axis"])]
    return {**found, "law": law, "misread": added}


def said(case: Case) -> dict[str, Any]:
    """The truth in words and numbers, SI units."""
    why = "a camera whose stand vibrates" if case.stand else "noise alone"
    why = "bending in more shapes than are stated" if case.modes else why
    found: dict[str, Any] = {
        "name": case.name, "arm": case.arm, "nothing": case.law is None and not case.camera,
        "form": "", "title": why, "target": "", "variable": "",
        "turns": False, "follows": "", "numbers": dict(case.stand),
        "recordings": {f"posture{n}": role for n, role in enumerate(ROLES)},
    }  # fmt: skip
    if found["nothing"]:
        return found
    form = CAMERA if case.law is None else case.law.form
    title, variable, follows = WORDS[form]
    if case.law is None:
        target, place = f"z{int(case.camera['axis']) + 1}", int(case.camera["axis"])
    else:
        target, place = f"joint{case.law.target + 1}", case.law.carrier
    found |= {
        "form": form, "title": title, "target": target, "turns": bool(follows),
        "variable": variable if variable == "t" else f"{variable}{place + 1}", "follows": follows,
        "numbers": dict(case.camera if case.law is None else case.law.numbers),
    }  # fmt: skip
    return found


@dataclass(frozen=True)
class Truth:
    """What is hidden in a folder."""

    words: Mapping[str, Any]
    """As `said` writes them."""
    along: Mapping[str, Mapping[str, np.ndarray]]
    """Recording -> time, angles, rates, tip, share, drive, law and misread."""


def read_truth(folder: Path) -> Truth:
    """What `written` has left beside a scenario."""
    words = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    along: dict[str, dict[str, np.ndarray]] = {name: {} for name in words["recordings"]}
    with np.load(folder / "truth.npz") as arrays:
        for key in arrays:
            recording, name = key.split("/")
            along[recording][name] = arrays[key]
    return Truth(words, along)


def line(truth: Truth) -> str:
    """A case in one line: what it hides, how large, and how far the joints move."""
    words = truth.words
    used = [a for n, a in truth.along.items() if words["recordings"][n] == "estimate"]
    law, drive, angles = (np.concatenate([a[n] for a in used]) for n in ("law", "drive", "angles"))
    size = f"{1e3 * np.sqrt(np.mean(law**2)):.2f} mm"
    if words["target"].startswith("joint"):
        torque = np.sqrt(np.mean(drive[:, int(words["target"][5:]) - 1] ** 2))
        share = np.sqrt(np.mean(law**2)) / torque
        size = f"{100.0 * share:.0f} % of {torque:.2f} N m"
    ends = zip(angles.min(axis=0), angles.max(axis=0), strict=True)
    ranges = ", ".join(f"{low:.2f} to {high:.2f}" for low, high in ends)
    hidden = f"{words['title']} {words['numbers']}"
    return f"{words['name']}: {hidden}, {size}; joints {ranges} rad"


def main(arguments: Sequence[str] | None = None) -> None:
    """Writes the cases that are asked for, each into a folder of its own."""
    parser = argparse.ArgumentParser(prog="python -m tests.programs.sample.hidden_laws")
    parser.add_argument("folder", type=Path)
    parser.add_argument("words", nargs="*", help="only cases whose names hold one of these")
    given = parser.parse_args(arguments)
    for name, case in cases().items():
        if any(word in name for word in given.words or [""]):
            written(case, given.folder / name)
            print(line(read_truth(given.folder / name)), flush=True)


if __name__ == "__main__":
    main()
