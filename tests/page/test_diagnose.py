"""A hidden effect is found and added, with real clicks."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from flexgui.session import Session
from flexgui.session.challenging import Challenge
from flexgui.session.edit import Document, put
from flexgui.session.effects import present
from flexgui.session.look import ladder_steps
from tests.page.helpers import plots, press, sees

FOUND = 60_000
"""ms: two searches of a few candidates on a busy machine."""

HEADLESS = 0.02
"""Relative: the command line goes on from a rough refit, the page from the end of one."""


def few(session: Session) -> None:
    """Two short recordings with hidden friction, a validation, and four candidates."""

    def edit(document: Document) -> None:
        document["recordings"] = [document["recordings"][k] for k in (0, 1, 3)]
        for entry in document["recordings"]:
            entry["simulate"]["seconds"] = 1.0

    kinds = ["coulomb_friction", "viscous_friction", "rotor_inertia", "tip_payload"]
    assert session.choose("something hidden", None)  # type: ignore[arg-type]
    assert session.change(edit, put(("diagnose", "candidates"), kinds))


def bars(page: Any) -> list[str]:
    """The numbers on the error ladder."""
    script = """() => JSON.stringify([...document.querySelectorAll('.js-plotly-plot')].filter(
      p => p.data.some(t => t.name === 'estimation recordings')).map(p => p.data[0].text)[0])"""
    return list(json.loads(page.evaluate(script)) or [])


def headless(session: Session) -> float:
    """What a diagnosis without a page reaches with one effect: rms in floors."""
    from core.diagnose.diagnose import Options, diagnose
    from core.diagnose.stated_noise import stated_noise
    from core.identify.setup import make_setup
    from core.loading import load_recordings
    from core.progress import Silent
    from core.workbench import base_model

    scenario = session.scenario
    model = base_model(scenario)
    recordings = load_recordings(scenario, model, session.folder, None, Silent())
    setup = make_setup(model, scenario.identify, recordings)
    noise = stated_noise(scenario, setup, recordings)
    options = Options(1, scenario.diagnose.candidates or (), scenario.diagnose.fidelity, noise)
    found = diagnose(setup, scenario.identify, recordings, options)
    return float(np.sqrt(found.steps[-1].cost_per_sample))


def test_the_hidden_effect_is_found_added_and_taken_back(page: Any, session: Session) -> None:
    few(session)
    press(page, "Diagnose")
    press(page, "Find what is missing")
    page.get_by_role("button", name="Add Coulomb friction", exact=True).wait_for(timeout=FOUND)
    page.get_by_text("Something is missing.").wait_for(timeout=FOUND)
    assert len(bars(page)) == 1 and "Coulomb friction" in plots(page)
    assert page.locator("svg.glimpse").count() >= 2, "pictures of the predictions"
    page.locator(".fx summary", has_text="What is it?").first.click()
    page.locator("details[open]", has_text="turns round with the direction").wait_for()
    expected = headless(session)
    press(page, "Add Coulomb friction")
    page.get_by_text("Nothing is missing.").wait_for(timeout=FOUND)
    page.wait_for_function(
        """() => [...document.querySelectorAll('.js-plotly-plot')].some(
          p => p.data.some(t => t.name === 'estimation recordings' && t.y.length === 2))"""
    )
    first, second = ladder_steps(session.looks)
    assert np.sqrt(second.cost_per_sample) == pytest.approx(expected, rel=HEADLESS)
    assert second.cost_per_sample < 0.05 * first.cost_per_sample
    sees(page, "In the model: Coulomb friction.")
    press(page, "Undo the last step")
    sees(page, "Something is missing.")
    page.wait_for_timeout(500)
    assert len(bars(page)) == 1 and not present(session.scenario)


def test_a_worst_place_is_one_click_away(page: Any, session: Session) -> None:
    few(session)
    press(page, "Identify")
    press(page, "Start identification")
    press(page, "Next: compare model and measurements")
    button = page.get_by_role("button").filter(has_text="× floor").first
    button.wait_for()
    label = button.inner_text()
    button.click()
    page.wait_for_timeout(500)
    assert label.startswith(session.cursor.recording) and session.cursor.time > 0.0


def test_guess_and_reveal(page: Any, session: Session) -> None:
    """The recordings are made by the session's tests; here the seal is opened by hand."""
    from core.study.seal import seal

    truth = {
        "seed": 4, "level": "easy", "effects": ["coulomb_friction"], "EI": 520.0,
        "values": {"fc1": 0.1823, "fc2": 0.1}, "shown": {"coulomb_friction": 3.0},
    }  # fmt: skip
    session.challenge = Challenge(4, "easy", seal(json.dumps(truth), "4 easy"))
    session.show("Diagnose")
    sees(page, "Challenge")
    page.get_by_text("Challenge", exact=True).first.click()
    sees(page, "You have not guessed yet.")
    assert "0.1823" not in page.content(), "the truth is not in the browser"
    press(page, "Commit to this guess")
    sees(page, "nothing is hidden")
    press(page, "Reveal")
    sees(page, "That was not it.")
    sees(page, "Coulomb friction of joint 1 fc1 = 0.1823 N m")
