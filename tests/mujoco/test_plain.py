"""Recordings of an independent engine, stated as a newcomer would: the right answer by default.

Each case takes a minute or two, so they run with `make long`. What is read is what an export
writes: `result.json`, as scripts read it.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from flexgui.core.progress import Silent
from flexgui.export.export_files import export_scenario

SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios" / "mujoco"
TRUTH = tomllib.loads((SCENARIOS / "truth.toml").read_text(encoding="utf-8"))

TIP_NOISE = 3e-5 * 2**0.5
"""m: the camera's noise of both axes together."""

FOLDER = SCENARIOS / "plain"
ONE_MODE, ONE_RECORDING = "-one_mode", "-one_recording"
ALL = sorted(path.stem for path in FOLDER.glob("*.toml"))
THREE = [name for name in ALL if not name.endswith(ONE_MODE)]
ONE = [name for name in ALL if name.endswith(ONE_MODE)]

EI = 500.0 / 0.96
"""N m^2: 520.83, of both segments."""

STIFFNESS = 0.02
"""Relative: how near the stiffness of the final model is asked to be."""

SIZE, FRICTION = 0.05, 0.08
"""Relative: how near sizes are asked to be, and those of dry friction, whose stops three modes
follow less well."""

SMOOTH, ROUGH = 1.3, 2.5
"""Times the camera's noise: the tip error that may be left, and where torques have edges."""

DRY = ("coulomb_friction",)
EDGED = (*DRY, "drive_saturation")

MODES = "extra_bending_mode"
PLAIN_KEYS = {"title", "arm", "drive", "identify", "diagnose", "recordings"}


OURS = {"mt": lambda v: {"mt2": v}, "tau": lambda v: {"tau1": v, "tau2": v}}
"""Names in truth.toml that differ from the effects' own; compliances stand below."""


def expected(effects: dict[str, dict[str, float]]) -> dict[str, float]:
    """parameter -> true size, in the names of the effects."""
    found: dict[str, float] = {}
    for parameters in effects.values():
        for name, value in parameters.items():
            if name[:1] == "k":
                found[f"c{name[1:]}"] = 1.0 / value
            elif name[:2] == "Jm":
                continue  # shapes the effect, is no size of its own
            else:
                found |= OURS.get(name, lambda v, n=name: {n: v})(value)
    return found


def hidden(name: str) -> dict[str, dict[str, float]]:
    """effect -> its parameters, of a plain scenario."""
    return TRUTH[name.removesuffix(ONE_MODE).removesuffix(ONE_RECORDING)]


Result = Callable[[str], dict[str, Any]]


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """result.json by the name of a plain scenario; each is exported once."""
    folder = tmp_path_factory.mktemp("plain")

    @cache
    def of(name: str) -> dict[str, Any]:
        export_scenario(FOLDER / f"{name}.toml", folder / name, None, Silent(), lambda _: None)
        text = (folder / name / "result.json").read_text(encoding="utf-8")
        found: dict[str, Any] = json.loads(text)
        return found

    return of


def named(found: dict[str, Any]) -> set[str]:
    """What was added and kept: the effects of the model as it now stands, by its parameters, and
    the modes by the ladder, which have none."""
    kinds = {p["of"] for p in found["parameters"]} - {"arm", "drive", "sensor"}
    return kinds | ({MODES} & {step["added"] for step in found["steps"]})


@pytest.mark.parametrize("name", ALL)
def test_a_plain_scenario_states_nothing_that_a_newcomer_would_not(name: str) -> None:
    text = tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8"))
    assert set(text) == PLAIN_KEYS
    assert set(text["identify"]) == {"parameters"}
    assert set(text["diagnose"]) == {"max_effects"}
    assert all(set(r) <= {"file", "role"} for r in text["recordings"])
    assert set(text["arm"]) <= {"preset", "modes", "young_modulus", "hub_inertia"}
    assert all(abs(x / 1e9 - 1.0) == pytest.approx(0.3) for x in text["arm"]["young_modulus"])


def test_every_case_is_also_stated_plainly() -> None:
    assert set(THREE) == set(TRUTH)
    assert len(ONE) >= 4


@pytest.mark.long
@pytest.mark.parametrize("name", THREE)
def test_just_what_is_hidden_is_named(name: str, result: Result) -> None:
    found = result(name)
    assert named(found) == set(hidden(name))
    assert found["verdict"] == ("missing" if hidden(name) else "nothing_missing")
    assert found["final_verdict"] == "nothing_missing"


@pytest.mark.long
@pytest.mark.parametrize("name", THREE)
def test_the_stiffness_of_the_final_model_is_the_true_one(name: str, result: Result) -> None:
    arm = {p["name"]: p["value"] for p in result(name)["parameters"] if p["of"] == "arm"}
    assert [arm["EI1"], arm["EI2"]] == pytest.approx([EI, EI], rel=STIFFNESS)


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in THREE if hidden(name)])
def test_sizes_are_near_the_true_ones(name: str, result: Result) -> None:
    found = {p["name"]: p["value"] for p in result(name)["parameters"]}
    for kind, parameters in hidden(name).items():
        share = FRICTION if kind in DRY else SIZE
        for parameter, true in expected({kind: parameters}).items():
            assert found[parameter] == pytest.approx(true, rel=share), parameter


@pytest.mark.long
@pytest.mark.parametrize("name", THREE)
def test_the_tip_error_that_is_left_is_the_cameras_noise(name: str, result: Result) -> None:
    most = ROUGH if set(EDGED) & set(hidden(name)) else SMOOTH
    assert result(name)["steps"][-1]["tip_rms_m"] < most * TIP_NOISE


@pytest.mark.long
@pytest.mark.parametrize("name", ONE)
def test_with_one_mode_the_missing_modes_are_named_and_the_rest_still_found(
    name: str, result: Result
) -> None:
    found = result(name)
    assert named(found) == {MODES, *hidden(name)}
    assert found["final_verdict"] == "nothing_missing"


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in ONE if ONE_RECORDING in name])
def test_one_recording_and_one_mode_lead_to_the_true_stiffness_and_sizes(
    name: str, result: Result
) -> None:
    found = {p["name"]: p["value"] for p in result(name)["parameters"]}
    assert [found["EI1"], found["EI2"]] == pytest.approx([EI, EI], rel=STIFFNESS)
    for parameter, true in expected(hidden(name)).items():
        assert found[parameter] == pytest.approx(true, rel=SIZE), parameter
