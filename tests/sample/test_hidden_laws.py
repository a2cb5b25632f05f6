"""Hidden laws: drawn alike each time, applied as they are written, on arms that move."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco", reason="needs MuJoCo: pip install '.[test]'")

from flexgui.core.scenario.read import read_scenario  # noqa: E402
from tests.mujoco.hidden_laws import TORQUES, slipped  # noqa: E402
from tests.sample import hidden_laws  # noqa: E402
from tests.sample.hidden_drawn import CAMERA, RIG, ROLES, Case, cases, intended  # noqa: E402
from tests.sample.hidden_laws import WORDS, read_truth, recorded, said, scenario_text  # noqa: E402

LAWS, NOTHING = 16, 8
TRAVEL = 0.8
"""rad, that each joint moves at least."""
REACHED = 2.0
"""rad, beyond which no joint is meant to go."""
BRIEF = 0.5
"""s of a recording, where a short one will do."""
FORM = {case.law.form: case for case in cases().values() if case.law is not None}
"""One case of each form; the last."""


@pytest.fixture
def briefly(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first part of each recording."""

    def first(arm: str, number: int) -> tuple[np.ndarray, ...]:
        return tuple(x[: round(BRIEF * RIG.rate)] for x in intended(arm, number))

    monkeypatch.setattr(hidden_laws, "intended", first)
    monkeypatch.setattr(hidden_laws, "SECONDS", BRIEF - 1.0 / RIG.rate)


def test_the_same_is_drawn_each_time() -> None:
    assert list(cases().values()) == list(cases().values())


def test_every_form_occurs_and_half_of_the_laws_are_on_a_rigid_arm() -> None:
    laws = [c for c in cases().values() if not said(c)["nothing"]]
    assert Counter(said(c)["form"] for c in laws).keys() == {*TORQUES, CAMERA} == set(WORDS)
    assert len(laws) == LAWS and len(cases()) == LAWS + NOTHING
    assert sum(c.arm == "rigid" for c in laws) == LAWS // 2


@pytest.mark.parametrize("form", sorted(TORQUES))
def test_the_engine_applies_the_torque_that_is_written(form: str, briefly: None) -> None:
    case = FORM[form]
    assert case.law is not None
    _, instants, _ = recorded(case, 0)
    along = {n: np.array([getattr(i, n) for i in instants]) for n in ("angles", "rates", "law")}
    time, share = (np.array([getattr(i, n) for i in instants]) for n in ("time", "share"))
    again = case.law.torque(along["angles"], along["rates"], time, share)
    assert np.abs(again).max() > 0.0
    np.testing.assert_allclose(along["law"][:, case.law.target], again, atol=1e-12)
    assert not along["law"][:, np.arange(case.joints) != case.law.target].any()


@pytest.mark.parametrize("name", ["nothing_noise_one", "hysteresis_rigid_joint2"])
def test_an_arm_moves_about_as_it_is_meant_to(name: str) -> None:
    case = cases()[name]
    rows, instants, _ = recorded(case, 0)
    angles = np.array([i.angles for i in instants])
    assert np.all(np.isfinite(rows)) and np.abs(angles).max() < REACHED
    assert np.all(np.ptp(angles, axis=0) > TRAVEL)


def test_the_direction_of_a_hysteresis_turns_over_its_way() -> None:
    share, way, step = -1.0, 0.1, 1e-4
    for _ in range(round(2.0 * way / step)):
        share = slipped(share, 1.0, step, way, 0.0)
    assert share == pytest.approx(1.0)
    assert slipped(share, -1.0, step, way, 0.0) < share


def test_files_hold_the_truth_and_the_scenario_says_nothing_of_it(
    tmp_path: Path, briefly: None
) -> None:
    case = cases()[next(n for n in cases() if n.startswith(CAMERA))]
    scenario = read_scenario(hidden_laws.written(case, tmp_path))
    truth = read_truth(tmp_path)
    assert [r.role for r in scenario.recordings] == list(ROLES)
    assert not scenario.model.effects and not scenario.model.own
    assert truth.words["target"] in ("z1", "z2") and truth.words["variable"] in ("z1", "z2")
    axis, along = int(truth.words["target"][1]) - 1, truth.along["posture0"]
    np.testing.assert_allclose(along["law"], along["misread"][:, axis])
    assert case.name in hidden_laws.line(truth)


def test_hidden_shapes_are_hidden_by_stating_fewer() -> None:
    known = cases()
    assert "modes = 1\n" in scenario_text(known["nothing_shape_one"])
    assert scenario_text(known["nothing_stand2_one"]) == scenario_text(Case("", "one"))
