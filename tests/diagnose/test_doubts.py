"""A noise floor that nothing can refute, and unseen recordings with a large error, show nothing."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flexgui.core.diagnose.remaining_error import FARTHEST, doubts
from flexgui.core.noise.noise_floor import UNCERTAINTY, Floor, spreads
from flexgui.core.results import ABOVE_IN_ONE, ChannelError, Diagnosis, DoubtReason
from flexgui.core.scenario.schema import Scenario
from flexgui.sentences.verdict import card_words, verdict_paragraphs
from tests.diagnose.fits import diagnosis_of, on_paper, set_up
from tests.diagnose.test_stated_effects import bare
from tests.identify.helpers import without
from tests.noise.floors import BARE, Case, clean, noisy
from tests.noise.floors import floors as found_floors

SHARE = st.floats(0.01, 10.0)


@given(rms=SHARE, floor=SHARE, unseen=SHARE)
@settings(deadline=None)
def test_an_error_within_the_floor_shows_something_if_floor_and_unseen_data_allow_it(
    rms: float, floor: float, unseen: float
) -> None:
    """All in spreads of the channel: just what contradicts it is named."""
    data = bare().data
    spread = spreads(data.experiments)["z1"]
    error = ChannelError("z1", "m", rms * spread, floor * spread, unseen * spread)
    known = {"z1": Floor(floor * spread, floor * spread, "estimated", UNCERTAINTY)}
    reasons = {d.reason for d in doubts(data, [error], known)}
    wanted = {DoubtReason.FLOOR_ABOVE_SPREAD} if floor > ABOVE_IN_ONE else set()
    wanted |= {DoubtReason.UNSEEN} if unseen > FARTHEST * floor else set()
    assert reasons == wanted


def test_without_unseen_recordings_nothing_is_said_of_them() -> None:
    data = bare().data
    error = ChannelError("z1", "m", 1e-5, 1e-5)
    assert not list(doubts(data, [error], {"z1": Floor(1e-5, 1e-5, "stated")}))


def test_a_noise_that_the_model_refutes_is_not_known() -> None:
    data = bare().data
    spread = spreads(data.experiments)["z1"]
    error = ChannelError("z1", "m", 0.2 * spread, 0.2 * spread)
    known = {"z1": Floor(0.2 * spread, 0.2 * spread, "estimated", UNCERTAINTY, refuted=spread)}
    assert [d.reason for d in doubts(data, [error], known)] == [DoubtReason.REFUTED_NOISE]


@pytest.mark.parametrize(("share", "refuted"), [(0.4, True), (0.7, False), (1.0, False)])
def test_a_residual_far_below_an_estimate_refutes_it_and_stands_in_its_place(
    share: float, refuted: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A floor was 1.5 times any smaller residual, so that 0.65 floors could not be refuted."""
    from flexgui.core.noise import noise_floor

    recording = noisy(Case(), clean(1e-3, 1.0, "prbs", 1), np.random.default_rng(1))
    plain = found_floors(BARE, [recording], ["z"], Case().processing)
    rms = noise_floor.channel_rms
    monkeypatch.setattr(
        noise_floor, "channel_rms", lambda e, r: {n: share * x for n, x in rms(e, r).items()}
    )
    for name, floor in found_floors(BARE, [recording], ["z"], Case().processing).items():
        assert (floor.refuted is not None) is refuted
        assert floor.noise <= plain[name].noise
        assert (floor.noise < 0.5 * plain[name].noise) is refuted


HIDDEN = {"viscous_friction": {"fv1": 6.0, "fv2": 3.0}}


def scenario(hidden: bool) -> Scenario:
    """Recordings in which nothing is missing, and one to judge by, which may have friction."""
    of_other_rig: dict[str, Any] = {"hidden": HIDDEN} if hidden else {}
    simulate = {"theta2": 1.2, "seconds": 0.4}
    return on_paper(
        sensors={"camera_noise": 3e-5, "encoder_noise": 1e-5},
        identify={"parameters": ["EI"], "output": ["z", "encoder"]},
        diagnose={"max_effects": 1, "candidates": ["tip_payload"]},
        recordings=[
            {"name": "a", "simulate": simulate},
            {"name": "b", "simulate": simulate, "role": "validate", **of_other_rig},
        ],
    )  # fmt: skip


@cache
def validated(hidden: bool) -> Diagnosis:
    """What is said of them."""
    return diagnosis_of(scenario(hidden))


def test_an_error_on_unseen_recordings_excludes_that_nothing_is_missing() -> None:
    found = validated(hidden=True)
    assert found.verdict == found.final_verdict == "cannot_be_judged"
    assert {d.reason for d in found.doubts} == {DoubtReason.UNSEEN}
    (first, *_) = verdict_paragraphs(found)
    assert first.startswith("It cannot be judged whether something is missing: on recordings")
    assert first.endswith("Fit some of those recordings too, and diagnose again.")
    assert "judged" in card_words(found)[1]


def test_unseen_recordings_at_the_floor_confirm_that_nothing_is_missing() -> None:
    found = validated(hidden=False)
    assert found.verdict == found.final_verdict == "nothing_missing" and not found.doubts


def test_an_unseen_recording_judges_the_channels_that_it_has() -> None:
    """It was left out where one output was missing, and nothing was said of it."""
    setup, recordings = set_up(scenario(hidden=False))
    lacking = without(recordings[1], "z")
    spec = scenario(hidden=False).identify
    judged = bare().validation_data(setup.processing, spec, [lacking])
    assert judged is not None
    names = [name for name, _ in judged.experiments[0].channels]
    assert dict(zip(names, judged.experiments[0].counted.any(axis=0), strict=True)) == {
        "z1": False, "z2": False, "theta1": True, "theta2": True,
        "deflection1": True, "deflection2": True,
    }  # fmt: skip
