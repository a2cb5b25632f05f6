"""A challenge: recordings of an arm with hidden effects, and the obfuscated truth.

The truth cannot be read by opening its file, and changes are noticed. It is obfuscated, not
encrypted: the phrase is in this file.
"""

from __future__ import annotations

import base64
import hashlib
import hmac
import json
import textwrap
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..challenge.challenge_rig import (
    CHANNELS,
    GAINS,
    STDS,
    Experiment,
    bare_model,
    readings,
    recording,
    simulate_exactly,
    with_noise,
)
from ..challenge.detectability import UnreachableError
from ..challenge.hidden_effect import (
    HiddenEffect,
    candidates,
    hide_effect,
    prerequisites,
    with_added,
)
from ..drives.velocity_loop import VelocityLoop
from ..effects import effect, with_included
from ..errors import InputError
from ..files import replacing
from ..model import Model
from ..recording.recording import Recording
from ..recording.save import save_recording
from ..recording.spec import SimulateSpec
from ..scenario.read import scenario_toml
from ..scenario.schema import Scenario
from ..sentences import did_you_mean

SCENARIO, TRUTH_FILE = "scenario.toml", "truth.sealed"

MOVE_SECONDS, SWEEP_SECONDS = 2.0, 5.0

LEVELS: Mapping[str, tuple[int, float, float]] = {"easy": (1, 3.0, 10.0), "hard": (2, 2.0, 4.0)}
"""level -> number of hidden effects, and their least and largest size in noise rms per sample."""

STIFFNESS = 0.05
"""Largest relative difference of the beams' true stiffness from nominal."""

RESOLUTION = 8
"""Digits after the point, in SI: a good sensor's, for small files."""

ATTEMPTS = 20


@dataclass(frozen=True)
class Challenge:
    """A challenge: a scenario whose files are the recordings, and the obfuscated truth."""

    scenario: Scenario
    recordings: tuple[Recording, ...]
    """In the scenario's order."""
    obfuscated: str


def make_challenge(seed: int, level: str = "easy") -> Challenge:
    """One hidden effect (easy) or two (hard) of random kinds and sizes; same seed, same data.
    InputError for another level or an impossible seed."""
    if level not in LEVELS:
        raise InputError(f"--level {level!r} is not known; {did_you_mean(level, LEVELS)}")
    if not 0 <= seed < 2**32:
        raise InputError(f"--seed {seed} is not possible; give a whole number below 2^32.")
    rng = np.random.default_rng([seed, *map(ord, level)])
    experiments = _experiments(rng)
    bare = _as_built(rng)
    truth = _truth(level, bare, experiments, rng)
    clean = [_recorded(e, truth.model) for e in experiments]
    recordings = [_rounded(r) for r in with_noise(clean, "white", [seed, len(level)])[0]]
    text = json.dumps({"seed": seed, "level": level, **truth.record}, sort_keys=True)
    return Challenge(
        _scenario(seed, recordings), tuple(recordings), obfuscate(text, f"{seed} {level}")
    )


@dataclass(frozen=True)
class _Truth:
    model: Model
    record: dict[str, Any]


def _experiments(rng: np.random.Generator) -> list[Experiment]:
    """Seven working points to estimate on, a sweep through all of them to validate."""
    seeds = rng.integers(1, 2**31, 8)
    points = [
        Experiment(
            f"th{k}",
            SimulateSpec(theta2=float(k * np.pi / 8), seconds=MOVE_SECONDS, seed=int(seeds[k - 1])),
        )
        for k in range(1, 8)
    ]
    ends = (float(np.pi / 8), float(7 * np.pi / 8))
    sweep = SimulateSpec(sweep=ends, seconds=SWEEP_SECONDS, excitation="prbs", seed=int(seeds[7]))
    return [*points, Experiment("sweep", sweep)]


def _as_built(rng: np.random.Generator) -> Model:
    """No beam is exactly as stiff as its drawing says."""
    nominal = bare_model()
    factor = 1.0 + STIFFNESS * rng.uniform(-1.0, 1.0)
    segments = tuple(
        s.model_copy(update={"young_modulus": (s.young_modulus or 0.0) * factor})
        for s in nominal.arm.segments
    )
    return replace(nominal, arm=nominal.arm.model_copy(update={"segments": segments}))


def _truth(
    level: str, bare: Model, experiments: Sequence[Experiment], rng: np.random.Generator
) -> _Truth:
    """The model with random effects, drawn until their sizes can be reached."""
    count, low, high = LEVELS[level]
    chosen = [e for e in experiments if e.spec.sweep is None][::3]
    for _ in range(ATTEMPTS):
        kinds = _kinds(count, rng)
        sizes = [float(np.exp(rng.uniform(np.log(low), np.log(high)))) for _ in kinds]
        try:
            effects = [
                hide_effect(effect(kind), bare, chosen, size, rng)
                for kind, size in zip(kinds, sizes, strict=True)
            ]
        except UnreachableError:
            continue
        return _together(bare, effects)
    raise InputError("No challenge can be made from this seed; try another.")


def _kinds(count: int, rng: np.random.Generator) -> list[str]:
    """Kinds with `count` parts in all; two of them at different locations."""
    possible = sorted(candidates())
    parts = {kind: 1 + len(prerequisites(effect(kind))) for kind in possible}
    fitting = [kind for kind in possible if parts[kind] <= count]
    chosen = [str(rng.choice(fitting))]
    if parts[chosen[0]] < count:
        location = effect(chosen[0]).location
        others = [k for k in fitting if parts[k] == 1 and effect(k).location != location]
        chosen.append(str(rng.choice(others)))
    return chosen


def _together(bare: Model, effects: Sequence[HiddenEffect]) -> _Truth:
    values: dict[str, float] = {}
    for h in effects:
        values |= {**h.base.effect_values, **h.values}
    kinds = [e for h in effects for e in h.base.effects] + [effect(h.kind) for h in effects]
    model = with_added(bare, with_included(kinds), values, effects[0].sizes)
    record = {
        "effects": [e.kind for e in model.effects],
        "values": {name: float(model.effect_values[name]) for name in sorted(model.effect_values)},
        "shown": {h.kind: h.level for h in effects},
        "EI": float(bare.parameters["EI"].value),
    }
    return _Truth(model, record)


def _recorded(experiment: Experiment, model: Model) -> Recording:
    task = experiment.task(model)
    role = "estimate" if experiment.spec.sweep is None else "validate"
    return recording(experiment, task, model, readings(model, simulate_exactly(model, task)), role)


def _rounded(r: Recording) -> Recording:
    channels = {
        name: np.round(x, RESOLUTION) if name in CHANNELS else x for name, x in r.channels.items()
    }
    return replace(r, time=np.round(r.time, RESOLUTION), channels=channels)


def _scenario(seed: int, recordings: Sequence[Recording]) -> Scenario:
    """The scenario to start with: the nominal arm without effects."""
    stated = [
        {"file": f"{r.name}.csv", "role": r.role}
        | ({} if r.theta2 is None else {"theta2": float(r.theta2)})
        for r in recordings
    ]
    return Scenario.model_validate({
        "title": f"Challenge {seed}: what is missing?",
        "arm": {"preset": "paper"},
        "drive": {"kind": VelocityLoop.kind, "gains": list(GAINS)},
        "model": {"level": "nonlinear"},
        "sensors": {"camera_noise": STDS["z1"], "encoder_noise": STDS["theta1"]},
        "identify": {"parameters": ["EI"], "output": ["z"], "generations": 0},
        "diagnose": {"max_effects": 3},
        "recordings": stated,
    })  # fmt: skip


def write_challenge(challenge: Challenge, out: Path) -> None:
    """Into the folder `out`, or into one file where its name ends in .zip."""
    if out.suffix.lower() == ".zip":
        _write_zip(challenge, out)
        return
    for r in challenge.recordings:
        save_recording(r, out / f"{r.name}.csv")
    for name, text in _texts(challenge).items():
        with replacing(out / name) as temporary:
            temporary.write_text(text, encoding="utf-8", newline="\n")


def _texts(challenge: Challenge) -> dict[str, str]:
    return {SCENARIO: scenario_toml(challenge.scenario), TRUTH_FILE: challenge.obfuscated}


def _write_zip(challenge: Challenge, out: Path) -> None:
    from tempfile import TemporaryDirectory

    with TemporaryDirectory() as folder, replacing(out) as temporary:
        write_challenge(challenge, Path(folder))
        with zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
            for path in sorted(Path(folder).iterdir()):
                # No date inside: same data, same bytes.
                entry = zipfile.ZipInfo(path.name)
                archive.writestr(entry, path.read_bytes(), zipfile.ZIP_DEFLATED)


def obfuscated_truth(place: Path) -> str:
    """The obfuscated truth of a challenge's folder or zip; InputError if there is none."""
    path = place / TRUTH_FILE if place.is_dir() else place
    try:
        if path.suffix.lower() == ".zip":
            with zipfile.ZipFile(path) as archive:
                return archive.read(TRUTH_FILE).decode("utf-8", "replace")
        return path.read_text(encoding="utf-8", errors="replace")
    except (OSError, KeyError, RuntimeError, EOFError, zlib.error, zipfile.BadZipFile):
        raise InputError(
            f"{place} holds no challenge; give what `flexgui challenge` wrote, a folder or a zip."
        ) from None


HEAD = "FlexGUI challenge, sealed. `flexgui reveal` opens it."

_PHRASE = b"no peeking before you have named the effect"
_SALT, _CODE, _WIDTH = 16, 32, 76
"""Bytes of salt and of the code that shows a change; characters in a line."""

_BLOCK = 2048
"""Bytes: shorter texts are padded, so that their length reveals nothing."""


def obfuscate(text: str, salt: str, head: str = HEAD) -> str:
    """The text obfuscated below a line `head`; the same text and salt give the same. Blanks at the
    end are lost."""
    own = hashlib.sha256(_PHRASE + salt.encode()).digest()[:_SALT]
    plain = text.encode()
    body = _mixed(plain.ljust(-(-len(plain) // _BLOCK) * _BLOCK), own)
    whole = base64.b64encode(own + _code(own, body) + body).decode()
    return "\n".join([head, *textwrap.wrap(whole, _WIDTH), ""])


def reveal(obfuscated: str, source: str, head: str = HEAD) -> str:
    """The obfuscated text; InputError if it was changed. `source` names the file."""
    broken = InputError(
        f"{source}: the file was changed (the seal is broken), so its content cannot be trusted."
    )
    first, _, body_text = obfuscated.replace("\r\n", "\n").partition("\n")
    if first.strip() != head:
        raise broken
    letters = "".join(body_text.split())
    try:
        whole = base64.b64decode(letters, validate=True)
    except ValueError:
        raise broken from None
    if base64.b64encode(whole).decode() != letters:
        raise broken  # the last letter has bits that decoding passes over
    own, code, body = whole[:_SALT], whole[_SALT : _SALT + _CODE], whole[_SALT + _CODE :]
    if not hmac.compare_digest(code, _code(own, body)):
        raise broken
    return _mixed(body, own).decode().rstrip()


def _mixed(text: bytes, salt: bytes) -> bytes:
    """The bytes combined with a stream from phrase and salt; applied twice it gives them back."""
    stream = b""
    while len(stream) < len(text):
        count = (len(stream) // 32).to_bytes(8, "big")
        stream += hashlib.sha256(_PHRASE + salt + count).digest()
    return bytes(a ^ b for a, b in zip(text, stream, strict=False))


def _code(salt: bytes, body: bytes) -> bytes:
    key = hashlib.sha256(salt + _PHRASE).digest()
    return hmac.new(key, salt + body, hashlib.sha256).digest()
