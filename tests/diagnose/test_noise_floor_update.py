"""Noise that was read beyond a model that lacked something is read anew beyond a better one."""

from __future__ import annotations

from dataclasses import replace

import pytest

from flexgui.core.diagnose.base_fit import BaseFit
from flexgui.core.diagnose.cost_minimum import converge
from flexgui.core.diagnose.final_ladder import final_ladder
from flexgui.core.diagnose.fit_problem import hypothesis
from flexgui.core.diagnose.noise_floor import UNCERTAINTY, Floor
from flexgui.core.diagnose.noise_floor_update import (
    LEAST_RATIO,
    apply_floors,
    exceeds_floors,
    find_higher_floors,
    find_lower_floors,
    search_with_new_floors,
)
from flexgui.core.diagnose.remaining_error import remaining_error, within_noise
from flexgui.core.diagnose.search_state import Options, State, base_ladder_step
from flexgui.core.effects import effect
from flexgui.core.progress import Silent
from tests.diagnose import fits
from tests.diagnose.test_stated_effects import bare

HIDDEN = 60.0
"""Times its size, that the noise seemed to be: the friction that is missing stays below."""

LARGER = 4.0
"""The same where the friction shows."""

READ_ANEW = 2.0
"""Factor within which floors of the same recording agree, whatever they were before."""

EXACT = 1e-9
"""Relative: what is known is stated in other units."""

SETTLED = 1e-3
"""Relative: what a further descent from a minimum gains."""

TRUE = {"EI1": 75.0, "EI2": 68.0, "cb": 8.7e-6}
"""The arm's mass swings on that base at 26 Hz."""


def never() -> bool:
    return False


class Stopped(Silent):
    """A person has pressed Stop."""

    def stopped(self) -> bool:
        return True


def with_floors(times: float, uncertainty: float = 1.0) -> BaseFit:
    """The model as given, in floors that many times as large as they are."""
    begun = bare()
    large = {
        n: Floor(times * f, times * f, "estimated", uncertainty)
        for n, f in begun.data.floors.items()
    }
    data = begun.data.in_floors(large)
    data, base = converge(data, hypothesis(data, (), begun.base.hypothesis.values()), None, never)
    return replace(begun, data=data, base=base)


def found_with(floors: float, kind: str = "torque_offset") -> tuple[State, BaseFit]:
    """A model with one effect, by default of no use in the place of the friction; floors that many
    times as large as they are."""
    given, added = with_floors(floors), [effect(kind)]
    start = hypothesis(given.data, added, given.base.hypothesis.values())
    there = converge(given.data, start, None, never)
    return State(*there, added, 0, [], [base_ladder_step(given)], None), given


def test_what_was_within_a_noise_that_is_none_is_above_what_there_is() -> None:
    state, given = found_with(HIDDEN)
    assert within_noise(state.data, state.refit.errors)
    floors = find_lower_floors(state, Options())
    assert floors is not None and exceeds_floors(state, floors)
    apply_floors(state, floors, never)
    assert not within_noise(state.data, state.refit.errors)
    for name, value in bare().data.floors.items():
        assert 1.0 / READ_ANEW < state.data.floors[name] / value < READ_ANEW


def test_all_that_is_stated_is_weighed_again_in_the_new_floors() -> None:
    """The model as given at its minimum there, its ranking, and each step of the ladder."""
    state, given = found_with(HIDDEN, "viscous_friction")
    floors = find_lower_floors(state, Options())
    assert floors is not None
    apply_floors(state, floors, never)
    asked = Options(candidates=("viscous_friction", "torque_offset"))
    state, begun = final_ladder(state, given, asked, Silent())
    assert begun.data.floors == state.data.floors
    for step in state.ladder:
        assert {e.channel: e.floor for e in step.errors} == state.data.floors
    first, last = state.ladder
    assert first.cost_per_sample == pytest.approx(begun.base.cost / begun.data.count, rel=EXACT)
    again = converge(begun.data, begun.base.hypothesis, None, never)[1]
    assert again.cost == pytest.approx(begun.base.cost, rel=SETTLED)
    (told,) = state.rounds
    assert told.accepted == "viscous_friction"
    assert {r.effect for r in told.ranking} == set(asked.candidates)
    assert last.cost_per_sample < first.cost_per_sample / LARGER


def test_a_search_that_is_stopped_before_that_goes_back_to_the_floors_before() -> None:
    state, given = found_with(HIDDEN)
    old, steps = dict(state.data.floors), list(state.ladder)
    floors = find_lower_floors(state, Options())
    assert floors is not None
    apply_floors(state, floors, never)
    state, begun = final_ladder(state, given, Options(), Stopped())
    assert begun is given and state.data.floors == old and state.ladder == steps


def test_an_estimated_floor_makes_no_verdict_that_is_finer_than_it_is_known() -> None:
    state, _ = found_with(1.0, "viscous_friction")
    up = {n: Floor(f / 1.3, f / 1.3, "stated") for n, f in state.data.floors.items()}
    left = remaining_error(state.data.in_floors(up), [1.3 * x for x in state.refit.errors])
    assert left.above
    loose = {n: replace(f, source="estimated", uncertainty=UNCERTAINTY) for n, f in up.items()}
    left = remaining_error(state.data.in_floors(loose), [1.3 * x for x in state.refit.errors])
    assert left.above_floors and not left.above


def test_floors_that_are_right_are_left_alone() -> None:
    state, _ = found_with(1.0, "viscous_friction")
    assert within_noise(state.data, state.refit.errors)
    floors = find_lower_floors(state, Options())
    assert floors is not None
    for name, old in state.data.floors.items():
        if name.startswith("deflection"):  # without noise, but for the digits that are written
            assert floors[name].value < old
        else:
            assert old / floors[name].value < LEAST_RATIO
    assert not exceeds_floors(state, floors)  # so that nothing is weighed again


def test_what_no_effect_explains_changes_nothing() -> None:
    """With a floor in which nothing is missing the search ends where it ended."""
    state, given = found_with(LARGER, "viscous_friction")
    options = Options(max_effects=2, candidates=("gravity_tilt",))
    ended, more = search_with_new_floors(state, options, Silent(), None)
    ended, begun = final_ladder(ended, given, options, Silent())
    assert not more and [e.kind for e in ended.added] == ["viscous_friction"]
    assert within_noise(ended.data, ended.refit.errors)
    assert begun is given and ended.data.floors == given.data.floors


def test_noise_is_at_most_what_no_effect_explains() -> None:
    """The friction that is missing stays below a noise that seems 60 times as large as it is."""
    given = with_floors(HIDDEN, UNCERTAINTY)
    state = State(given.data, given.base, [], 0, [], [base_ladder_step(given)], None)
    assert within_noise(state.data, state.refit.errors)
    options = Options(max_effects=2, candidates=("viscous_friction", "torque_offset"))
    ended, _ = search_with_new_floors(state, options, Silent(), None)
    assert [e.kind for e in ended.added] == ["viscous_friction"]


def on_a_soft_base() -> tuple[State, BaseFit]:
    """A torque rig with the base in the model, and the floors of the arm on a rigid one."""
    beams = (0.64, 2.8, 75.0, 0.12), (0.69, 1.5, 68.0, 0.077)
    segments = [
        {"length": L, "mass": m, "EI": EI, "hub_inertia": J, "modes": 1} for L, m, EI, J in beams
    ]
    hidden = {"base_compliance": {"cb": TRUE["cb"]}}
    given = fits.begun(fits.on_paper(
        arm={"segments": segments},
        drive={"kind": "torque"},
        sensors={"encoder_noise": 3e-6},
        identify={"parameters": ["EI1", "EI2"], "filter": {"cutoff_hz": 60.0}},
        recordings=[{"simulate": {"theta2": 1.2, "seconds": 1.0}, "hidden": hidden}],
    ))  # fmt: skip
    added = [effect("base_compliance")]
    there = converge(given.data, hypothesis(given.data, added, TRUE), None, never)
    return State(*there, added, 0, [], [base_ladder_step(given)], None), given


def above(state: State) -> float:
    """The error of the worst channel, in noise floors."""
    return max(remaining_error(state.data, state.refit.errors).by_channel.values())


def test_noise_shakes_an_arm_on_a_soft_base_more_than_one_on_rock() -> None:
    state, given = on_a_soft_base()
    assert above(state) > UNCERTAINTY  # with the model complete
    floors = find_higher_floors(state, Options())
    assert floors is not None and floors["u1"].value > LEAST_RATIO * state.data.floors["u1"]
    assert all(one.value >= state.data.floors[name] for name, one in floors.items())
    apply_floors(state, floors, never)
    assert above(state) < UNCERTAINTY


@pytest.mark.long
def test_floors_of_led_arms_that_are_right_are_left_alone() -> None:
    state, given = on_a_soft_base()
    floors = find_higher_floors(state, Options())
    assert floors is not None
    apply_floors(state, floors, never)
    assert find_higher_floors(state, Options()) is None


def test_noise_moves_no_arm_that_is_not_led_along_it() -> None:
    state, _ = found_with(1.0 / HIDDEN, "viscous_friction")
    assert find_higher_floors(state, Options()) is None
