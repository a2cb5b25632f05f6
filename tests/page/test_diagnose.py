"""A hidden effect is found and added, with real clicks."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from flexgui.jobs.messages import DEFAULT
from flexgui.session.scenario_edits import set_value
from flexgui.session.session import Session
from flexgui.stages.challenge.state import Challenge
from flexgui.stages.diagnose.effects import present, titled
from flexgui.stages.diagnose.model_versions import ladder_steps
from tests.jobs.helpers import process_id, task
from tests.page.conftest import Desktop
from tests.page.helpers import LOOK, field, pick, plots, press, sees
from tests.session.helpers import HIDDEN_FRICTION, shortened, until

FOUND = 60_000
"""ms: two searches of a few candidates on a busy machine."""

HEADLESS = 0.02
"""Relative: the command line goes on from a rough refit, the page from the end of one."""


@pytest.fixture(autouse=True)
def apart(page: Any) -> Iterator[None]:
    """The view that a test turns and the stories that it opens are gone before the next begins."""
    yield
    page.goto("about:blank")


def few(session: Session) -> None:
    """Two short recordings with hidden friction, a validation, and four candidates."""
    kinds = ["coulomb_friction", "viscous_friction", "rotor_inertia", "tip_payload"]
    assert session.choose("something hidden")
    assert session.document.change(shortened(0, 1, 3), set_value(("diagnose", "candidates"), kinds))


def bars(page: Any) -> list[str]:
    """The numbers on the error ladder."""
    script = """() => JSON.stringify([...document.querySelectorAll('.js-plotly-plot')].filter(
      p => p.data.some(t => t.name === 'estimation'))
      .map(p => p.data[0].text)[0] ?? [])"""
    return list(json.loads(page.evaluate(script)))


def headless(session: Session) -> float:
    """What a run without a page reaches with one effect: rms in floors."""
    from flexgui.core.workbench import run_scenario

    scenario = session.document.scenario
    settings = scenario.diagnose.model_copy(update={"max_effects": 1})
    outcome = run_scenario(
        scenario.model_copy(update={"diagnose": settings}), folder=session.folder
    )
    assert outcome.diagnosis is not None
    return float(np.sqrt(outcome.diagnosis.steps[-1].cost_per_sample))


def test_the_hidden_effect_is_found_added_and_taken_back(page: Any, session: Session) -> None:
    few(session)
    press(page, "Diagnose")
    press(page, "Find what is missing")
    page.get_by_role("button", name="Add Coulomb friction", exact=True).first.wait_for(
        timeout=FOUND
    )
    page.get_by_text("Something is missing.").wait_for(timeout=FOUND)
    until(lambda: len(bars(page)) == 1 and "Coulomb friction" in plots(page))
    page.locator("svg.glimpse").nth(1).wait_for()  # pictures of the predictions
    page.locator(".fx summary", has_text="What is it?").first.click()
    page.locator("details[open]", has_text="reverses with the direction").wait_for()
    expected = headless(session)
    press(page, "Add Coulomb friction")
    page.get_by_text("Nothing is missing.").wait_for(timeout=FOUND)
    page.wait_for_function(
        """() => [...document.querySelectorAll('.js-plotly-plot')].some(
          p => p.data.some(t => t.name === 'estimation' && t.y.length === 2))"""
    )
    first, second = ladder_steps(session.diagnosis.versions)
    assert np.sqrt(second.cost_per_sample) == pytest.approx(expected, rel=HEADLESS)
    assert second.cost_per_sample < 0.05 * first.cost_per_sample
    sees(page, "In the model: Coulomb friction.")
    sees(page, "With Coulomb friction")  # beside the model as given
    press(page, "Undo the last step")
    sees(page, "Something is missing.")
    until(lambda: len(bars(page)) == 1 and not present(session.document.scenario))
    sees(page, "Models of this session")
    press(page, "Return to Coulomb friction")
    until(lambda: len(bars(page)) == 2 and bool(present(session.document.scenario)))
    press(page, "Beside As given")
    until(lambda: len(bars(page)) == 3 and "beside: As given" in ladder_names(page))


LADDER_NAMES = """() => [...document.querySelectorAll('.js-plotly-plot')]
  .filter(p => p.data.some(t => t.name === 'estimation')).map(p => p.layout.yaxis.ticktext.join())
  .join()"""


def ladder_names(page: Any) -> str:
    """What its rows are called."""
    return str(page.evaluate(LADDER_NAMES)).replace("<br>", " ")


def on_screen(page: Any, camera: Any, place: np.ndarray) -> tuple[float, float]:
    """px of a place (3,) m, as the client's camera sees it in its canvas."""
    ahead = camera.look_at - camera.position
    ahead = ahead / np.linalg.norm(ahead)
    right = np.cross(ahead, camera.up_direction)
    right = right / np.linalg.norm(right)
    up, to = np.cross(right, ahead), place - camera.position
    spread = np.tan(0.5 * camera.fov) * (to @ ahead)
    boxes = [canvas.bounding_box() for canvas in page.locator("canvas").all()]
    box = max(boxes, key=lambda b: b["width"] * b["height"])
    x = 0.5 + 0.5 * (to @ right) / spread * box["height"] / box["width"]
    y = 0.5 - 0.5 * (to @ up) / spread
    return box["x"] + box["width"] * float(x), box["y"] + box["height"] * float(y)


@pytest.mark.long
def test_a_click_on_the_map_in_the_scene_goes_there(
    page: Any, desktop: Desktop, session: Session
) -> None:
    few(session)
    press(page, "Identify")
    press(page, "Start identification")
    press(page, "Next: compare model and measurements")
    errors = desktop.pages[-1]._scene._errors
    until(lambda: errors._board is not None)
    assert errors._board is not None and session.comparison.failing is not None
    board = session.comparison.failing.board
    assert board is not None and len(board.recordings) == 3
    place = errors._board._point((7 + 0.5) / 12, (1 + 0.5) / 3)

    def clicked() -> bool:
        """The browser may not have drawn the map yet, or still turn the view."""
        page.mouse.click(*on_screen(page, desktop.pages[-1].context.client.camera, place))
        page.wait_for_timeout(500)
        return session.playback.cursor.recording == board.recordings[1]

    until(clicked)
    assert board.edges[7] < session.playback.cursor.time < board.edges[8]
    sees(page, "error at this moment, in noise floors of each output: θ₁ ")
    press(page, "Data")
    until(lambda: errors._board is None)


@pytest.mark.long
def test_an_effect_is_demonstrated_beside_its_story(page: Any, session: Session) -> None:
    few(session)
    press(page, "Diagnose")
    page.get_by_text("Add or remove by hand", exact=True).click()
    press(page, "Show what it does")
    sees(page, "the recording with the largest change.")
    until(lambda: '"what it changes"' in plots(page))
    page.locator(".fx math").first.wait_for()
    press(page, "Hide what it does")
    page.get_by_text("where it changes most.").wait_for(state="hidden")


@pytest.mark.long
def test_a_typed_formula_is_fitted_and_ranked_and_a_hostile_one_refused(
    page: Any, session: Session
) -> None:
    few(session)
    press(page, "Diagnose")
    press(page, "Find what is missing")
    page.get_by_text("Something is missing.").wait_for(timeout=FOUND)
    page.get_by_text("Add your own effect as a formula", exact=True).click()
    field(page, "Formula").fill("__import__('os').system('true')")
    press(page, "Add this formula")
    page.locator(".fx .bad", has_text="formula").first.wait_for()
    assert not present(session.document.scenario)
    field(page, "Formula").fill("-a*tanh(dtheta1/0.001)")
    field(page, "Parameters").fill("a = 0.5 [N m]")
    page.wait_for_timeout(300)
    press(page, "Add this formula")
    sees(page, "In the model: Own effect 1 at joint1.")
    page.get_by_text("Your formula is number ").wait_for(timeout=FOUND)
    until(lambda: session.diagnosis.newest is not None and bool(session.diagnosis.newest.ranking))
    session.run.stop()  # its button may be gone: few candidates are soon refitted
    until(lambda: not session.run.busy)
    press(page, "Undo the last step")
    page.get_by_role("button", name="Add Own effect 1 at joint1", exact=True).wait_for()


@pytest.mark.long
@pytest.mark.parametrize("moment", ["at once", "first look", "ranking"])
def test_stop_works_at_every_moment(page: Any, session: Session, moment: str) -> None:
    """On whole recordings with every effect. Held from that moment on, since on a busy machine the
    search can end before a click arrives; a search that is held is stopped like any other."""
    assert session.choose("something hidden")
    press(page, "Diagnose")
    press(page, "Find what is missing")
    come: dict[str, Callable[[], bool]] = {
        "at once": lambda: True,
        "first look": lambda: session.diagnosis.newest is not None,
        "ranking": lambda: (
            session.diagnosis.newest is not None and bool(session.diagnosis.newest.ranking)
        ),
    }
    until(come[moment])
    session.run.pause()
    press(page, "Stop")
    until(lambda: not session.run.busy and session.diagnosis.pending is None)
    sees(page, "Stopped")
    again = re.compile("Find what is missing|Repeat diagnosis")
    page.get_by_role("button", name=again, disabled=False).first.wait_for()
    assert not present(session.document.scenario) and len(session.diagnosis.versions) <= 1


@pytest.mark.long
def test_guess_and_reveal(page: Any, session: Session) -> None:
    few(session)
    session.challenge.state = Challenge(4, "easy", HIDDEN_FRICTION)
    press(page, "Challenge")
    sees(page, "One effect is hidden.")
    press(page, "Compare")
    sees(page, "Nothing was identified yet.")
    press(page, "Challenge")
    sees(page, "One effect is hidden.")
    assert "0.1823" not in page.content(), "the truth is not in the browser"
    press(page, "Commit to this guess")
    sees(page, "Your guess: nothing is hidden.")
    assert not page.get_by_role("button", name="Commit to this guess").count(), "it stands"
    press(page, "Reveal")
    sees(page, "That was not it.")
    sees(page, "Who found what")
    sees(page, "Coulomb friction of joint 1 = 0.1823 N m")


AT_ONCE = """([field, button, texts]) => {
  const put = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set;
  for (const text of texts) {
    put.call(field, text);
    field.dispatchEvent(new Event("input", {bubbles: true}));
  }
  button.click();
}"""
"""Keys and a click within one turn of the browser: viser sends one message in 50 ms at most, so
that the click would take the place of the last key."""


@pytest.mark.long
def test_a_size_is_committed_as_the_field_shows_it(page: Any, session: Session) -> None:
    few(session)
    session.challenge.state = Challenge(4, "easy", HIDDEN_FRICTION)
    session.show("Challenge")
    choose(page, "Coulomb friction")
    row = page.get_by_text("fc1 [N m]", exact=True).first.locator("xpath=ancestor::*[.//input][1]")
    field = row.locator("input")
    field.fill("banana")
    press(page, "Commit to this guess")
    sees(page, "“banana” is not a number")
    button = page.get_by_role("button", name="Commit to this guess", exact=True)
    handles = [field.element_handle(), button.element_handle()]
    page.evaluate(AT_ONCE, [*handles, ["0", "0,", "0,25"]])
    sees(page, "Your guess: Coulomb friction, fc1 = 0.25 N m.")


def choose(page: Any, title: str) -> None:
    """An effect as the guess."""
    pick(page, "Your guess", title)
    page.wait_for_timeout(300)


def answer(page: Any, kind: str) -> None:
    """Commits to the right effect, and looks."""
    choose(page, titled([kind])[0])
    press(page, "Commit to this guess")
    press(page, "Reveal")
    sees(page, "You found it.")
    sees(page, "Who found what")


def stands(page: Any, name: str) -> None:
    """Waits until a button keeps its place: pressed here and let go there it is not clicked, and on
    a busy machine a stage's words come one after the other."""
    button = page.get_by_role("button", name=name, exact=True).first
    button.wait_for()
    places = [None]

    def kept() -> bool:
        places.append(button.bounding_box())
        page.wait_for_timeout(LOOK)
        return bool(places[-1] == places[-2])

    until(kept)


def hidden_in(session: Session, page: Any, desktop: Desktop) -> Challenge:
    """The challenge, once it is made; where it is not, what the browser says instead."""
    end = time.monotonic() + FOUND / 1000.0
    while session.challenge.state is None:
        if time.monotonic() > end:
            shown = page.locator("body").inner_text()
            pytest.fail(f"{len(desktop.pages)} pages: {shown}")
        page.wait_for_timeout(LOOK)
    return session.challenge.state


@pytest.mark.long
def test_a_challenge_with_real_clicks(page: Any, session: Session, desktop: Desktop) -> None:
    # A job that the test before has stopped may keep its worker for a while, and then the worker
    # is replaced, which takes longer than the challenge itself on a busy machine.
    free = desktop.services.pool.submit("before", task(process_id), lambda _: None)
    assert free.wait(DEFAULT.grace + DEFAULT.start_limit)
    press(page, "Challenge")
    stands(page, "Hide an effect")
    press(page, "Hide an effect")
    known = hidden_in(session, page, desktop)
    sees(page, "these recordings hide an effect")
    answer(page, known.truth.effects[0])
    session.run.stop()


@pytest.mark.long
def test_what_is_known_of_the_rig_is_ticked_and_not_offered(page: Any, session: Session) -> None:
    few(session)
    press(page, "Diagnose")
    page.get_by_text("What do you know about this rig?").click()
    level = page.get_by_role("checkbox", name="The rig is level")
    level.click()
    until(lambda: session.document.scenario.rig.level)
    page.locator(".tick[aria-checked=true]", has_text="The rig is level").wait_for()
    field(page, "Gear ratios").fill("50, 100")
    until(lambda: session.document.scenario.rig.gear_ratio == (50.0, 100.0))
    level.click()
    until(lambda: not session.document.scenario.rig.level)
