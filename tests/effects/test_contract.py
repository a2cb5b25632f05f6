"""What every effect in the folder must say and keep; a new file inherits these tests."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from pint import UnitRegistry

from flexgui.core.arm.presets import presets
from flexgui.core.drives.servo import FollowingServo
from flexgui.core.drives.torque import Torque
from flexgui.core.drives.velocity_loop import VelocityLoop
from flexgui.core.effects import Rig, catalogue, effect
from flexgui.core.effects.sizes import typical
from flexgui.core.model import Model
from tests.effects.helpers import (
    KINDS,
    base_for,
    experiment,
    forced,
    moved,
    neutral,
    parameters_of,
    primary,
    readings,
    recover,
    rig_of,
    with_effect,
)
from tests.helpers import PAPER, looped, with_modes

ROOMS = {
    "joint": (
        "viscous_friction coulomb_friction stribeck_friction presliding_friction "
        "friction_asymmetry joint_elasticity rotor_inertia backlash torque_ripple load_friction"
    ),
    "drive": "drive_saturation drive_lag torque_offset drive_gain",
    "segments": (
        "structural_damping extra_bending_mode tip_payload link_mass_error cubic_stiffness "
        "air_drag base_compliance base_rotation"
    ),
    "motion": "large_motion gravity_tilt",
    "sensors": (
        "camera_delay camera_misalignment sensor_lag encoder_offset sensor_delay sensor_gain"
    ),
}
"""The ids of design section 5 by where they sit."""

PLACES = {"joints", "tip", "segments", "base", "camera", "drive"}

SHORTEST_STORY = 120
"""Characters: what it is, where it acts, what it leaves in the residual."""

ONE_MODE, TWO_MODES = PAPER, with_modes(2, 2)

SINGLE = Rig(
    presets()["single_axis"], Torque(), "nonlinear", ("torque",), servo=True
)  # fmt: skip
"""A rigid slide whose force is recorded."""

UNITS = UnitRegistry()


def test_the_ids_are_those_that_result_files_use() -> None:
    wanted = {kind: room for room, kinds in ROOMS.items() for kind in kinds.split()}
    assert {kind: one.location for kind, one in catalogue().items()} == wanted


@pytest.mark.parametrize("kind", KINDS)
def test_effect_explains_itself(kind: str) -> None:
    one = effect(kind)
    assert one.kind == kind
    assert one.__doc__ and one.title and one.title[0].isupper()
    assert len(one.story) > SHORTEST_STORY and one.story.endswith(".")
    assert one.formula and one.formula.count("{") == one.formula.count("}")
    assert one.acts_at in PLACES
    assert all(simpler in KINDS for simpler in one.includes)


@pytest.mark.parametrize("kind", KINDS)
def test_parameters_are_complete(kind: str) -> None:
    for quantity in parameters_of(effect(kind)):
        item = quantity.parameter
        assert item.title and item.symbol and item.scale > 0.0
        assert item.symbol.count("{") == item.symbol.count("}")
        assert np.isfinite([item.lower, item.upper, quantity.neutral]).all()
        assert item.lower < item.value < item.upper
        assert item.value != quantity.neutral or quantity.secondary
        assert item.value != 0.0
        assert all(item.lower <= size <= item.upper for size in quantity.grid)
        assert len(set(quantity.grid)) == len(quantity.grid)
        UNITS.parse_units(item.unit)


@pytest.mark.parametrize("kind", KINDS)
def test_parameters_keep_their_names_whatever_moves(kind: str) -> None:
    """Sizes from recordings move starts and bounds, never names or units."""
    one = effect(kind)
    guessed = one.parameters(one.changed_arm(PAPER, {}), looped(PAPER).drive, typical(PAPER))
    seen = parameters_of(one)
    assert [(k.parameter.name, k.parameter.unit) for k in guessed] == [
        (k.parameter.name, k.parameter.unit) for k in seen
    ]
    names = [k.parameter.name for k in seen]
    assert len(set(names)) == len(names)


def test_no_two_effects_have_a_parameter_in_common_unless_one_is_part_of_the_other() -> None:
    """Hub inertia belongs to elastic joints and backlash too, as a secondary one."""
    names = {kind: {k.parameter.name for k in primary(effect(kind))} for kind in KINDS}
    for a, b in itertools.combinations(KINDS, 2):
        assert not names[a] & names[b], (a, b)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("arm", [ONE_MODE, TWO_MODES], ids=["one mode", "two modes"])
def test_neutral_values_leave_the_bare_model(kind: str, arm) -> None:  # type: ignore[no-untyped-def]
    one = effect(kind)
    base = base_for(one, arm)
    switched_off = base.with_effects([one], _all_neutral(kind, arm))
    assert (switched_off is base) == bool(parameters_of(one, arm))


@pytest.mark.parametrize("kind", [kind for kind in KINDS if parameters_of(effect(kind))])
@pytest.mark.parametrize("arm", [ONE_MODE, TWO_MODES], ids=["one mode", "two modes"])
def test_an_effect_kept_at_neutral_changes_no_bit(kind: str, arm) -> None:  # type: ignore[no-untyped-def]
    one = effect(kind)
    base = base_for(one, arm)
    kept = forced(one, base, neutral(primary(one, arm)))
    task = experiment(base, seconds=0.3)
    assert np.array_equal(task.start, experiment(kept, seconds=0.3).start)
    before, after = (moved(m, task, base.level) for m in (base, kept))
    assert np.array_equal(before.q, after.q) and np.array_equal(before.v, after.v)
    assert np.array_equal(before.torque, after.torque)
    dt = task.sample_time
    seen, expected = readings(kept, after, dt), readings(base, before, dt)
    assert all(np.array_equal(seen[sensor], y) for sensor, y in expected.items())


@pytest.mark.parametrize("kind", KINDS)
def test_an_effect_is_seen_by_a_camera_or_an_encoder(kind: str) -> None:
    base = base_for(effect(kind))
    model = with_effect(kind, base)
    task = experiment(model, seconds=0.3, amplitude=1.0)
    dt = task.sample_time
    seen = readings(model, moved(model, task), dt)
    expected = readings(base, moved(base, experiment(base, seconds=0.3, amplitude=1.0)), dt)
    apart = max(float(np.abs(seen[s] - expected[s]).max()) for s in ("z", "encoder"))
    assert 1e-7 < apart < np.inf


@pytest.mark.parametrize("kind", KINDS)
def test_values_reach_the_model(kind: str) -> None:
    """What a fit varies is what is simulated: `numbers` agrees with a model built at a value."""
    one = effect(kind)
    base = base_for(one)
    model = with_effect(kind, base)
    for quantity in primary(one):
        name, value = quantity.parameter.name, 1.05 * quantity.parameter.value
        built = with_effect(kind, base, {**model.effect_values, name: value}).numbers()
        varied = model.numbers({name: value})
        assert np.array_equal(built.p, varied.p)
        assert np.array_equal(built.law.limit, varied.law.limit)
        assert np.array_equal(built.law.Fs, varied.law.Fs)
        assert [e.values for e in built.elements] == [e.values for e in varied.elements]


def _all_neutral(kind: str, arm) -> dict[str, float]:  # type: ignore[no-untyped-def]
    values: dict[str, float] = {}
    for part in (*effect(kind).includes, kind):
        values |= neutral(primary(effect(part), arm))
    return values


@pytest.mark.parametrize("kind", KINDS)
def test_what_a_rig_cannot_show_is_said_in_a_sentence(kind: str) -> None:
    for rig in (rig_of(looped(PAPER)), rig_of(looped(PAPER, level="lpv")), SINGLE):
        reason = effect(kind).not_applicable(rig)
        assert reason == "" or (reason[0].isupper() and reason.endswith("."))


def test_what_comes_before_a_recorded_torque_does_not_apply() -> None:
    servo = FollowingServo(VelocityLoop(gains=(60.0, 30.0)), 60.0, (1.0, 1.0))
    recorded = rig_of(Model(PAPER, Torque()))
    held = rig_of(looped(PAPER).steered_by(servo), servo=True)
    for kind in ("drive_saturation", "drive_lag"):
        assert effect(kind).not_applicable(rig_of(looped(PAPER))) == ""
        assert "recorded" in effect(kind).not_applicable(recorded)
        assert "recorded" in effect(kind).not_applicable(held)
        assert "recorded" in effect(kind).not_applicable(SINGLE)


@pytest.mark.parametrize("kind", [k for k in KINDS if not effect(k).not_applicable(SINGLE)])
def test_effects_that_apply_to_a_slide_build_on_it(kind: str) -> None:
    one = effect(kind)
    model = Model(SINGLE.arm, VelocityLoop(gains=(200.0,))).with_effects([one])
    assert all(np.isfinite(element.values).all() for element in model.numbers().elements)
    if one.location == "joint":
        quantities = one.parameters(model.arm, model.drive, typical(SINGLE.arm))
        assert not any("rad" in quantity.parameter.unit for quantity in quantities)


PLAIN = [
    kind
    for kind in KINDS
    if effect(kind).changed_arm(PAPER, {}).coordinates == PAPER.coordinates
    and not effect(kind).not_applicable(rig_of(looped(PAPER)))
]
"""Without those that change the structure, which would be compiled in every mixture."""


@pytest.mark.parametrize("seed", range(12))
def test_any_three_effects_go_together(seed: int) -> None:
    chosen = [str(kind) for kind in np.random.default_rng(seed).choice(PLAIN, 3, replace=False)]
    _goes(*chosen)


@pytest.mark.parametrize(
    "chosen",
    [
        ("joint_elasticity", "backlash", "coulomb_friction"),
        ("joint_elasticity", "drive_lag", "presliding_friction"),
        ("backlash", "drive_saturation", "tip_payload"),
    ],
)
def test_effects_that_change_the_structure_go_with_others_in_any_order(
    chosen: tuple[str, ...],
) -> None:
    states = [_goes(*order) for order in (chosen, chosen[::-1])]
    first, second = states
    assert np.abs(first - second).max() < 1e-9


def _goes(*kinds: str) -> np.ndarray:
    """The joints' motion with these effects; finite, or the test fails."""
    base = looped(PAPER)
    model = base.with_effects([effect(kind) for kind in kinds])
    assert {one.kind for one in model.effects} >= set(kinds)
    q = moved(model, experiment(model, seconds=0.1)).joint_positions
    assert np.isfinite(q).all() and np.abs(q).max() < 10.0
    return q


def test_what_is_included_comes_along_and_stays_when_the_rest_vanishes() -> None:
    base = looped(PAPER)
    model = with_effect("stribeck_friction", base)
    assert [one.kind for one in model.effects] == ["coulomb_friction", "stribeck_friction"]
    only = with_effect("stribeck_friction", base, {"fb1": 0.0, "fb2": 0.0})
    assert [one.kind for one in only.effects] == ["coulomb_friction"]


INTERVAL = 3.0
"""Standard deviations; some forty sizes are recovered, each from the same noise."""

SURE = 0.15
"""Of the size: an interval that holds everything would prove nothing."""

WHITE = (0.9, 1.1)
"""Mean square of what remains, in units of the noise: four thousand samples scatter by 0.02."""


@pytest.mark.parametrize("kind", [kind for kind in KINDS if primary(effect(kind))])
def test_a_hidden_size_is_recovered_within_its_interval(kind: str) -> None:
    found = recover(kind)
    assert WHITE[0] < found.misfit < WHITE[1]
    assert np.all(found.std < SURE * np.abs(found.truth))
    assert np.all(found.deviations < INTERVAL)
