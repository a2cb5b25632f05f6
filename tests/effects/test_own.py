"""Effects that a user states as a formula."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.effects import effect
from flexgui.core.effects.own import OwnEffect, own_effect
from flexgui.core.effects.own_formula import own_parameter
from flexgui.core.forces.compiled import compile_law
from flexgui.core.forces.element import linear_matrices
from flexgui.core.loading import load_recordings
from flexgui.core.model import Model
from flexgui.core.progress import Silent
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.scenario.read import parse_scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.core.simulate.experiment import make_task
from flexgui.core.simulate.nonlinear import simulate_within
from tests.approved import approved
from tests.helpers import PAPER, jacobian, looped, refusal

SAME = 1e-12
"""rad or m: two integrations of one law that differ in nothing but rounding."""


def own(target: str, formula: str, **starts: float) -> OwnEffect:
    parameters = tuple(own_parameter(name, value) for name, value in starts.items())
    return own_effect(PAPER, target, formula, parameters, "own_1")


def motion(model: Model) -> np.ndarray:
    task, _ = make_task(model, SimulateSpec(theta2=1.0, seconds=0.3), "r")
    trajectory = simulate_within(model, model.numbers(), task).trajectory
    return np.hstack([trajectory.q, trajectory.tip()[0]])


def apart(one: Model, other: Model) -> float:
    return float(np.abs(motion(one) - motion(other)).max())


@pytest.mark.parametrize(
    ("kind", "target", "formula", "size", "values"),
    [
        ("viscous_friction", "joint1", "-a*dtheta1", 7.0, {"fv1": 7.0, "fv2": 0.0}),
        ("friction_asymmetry", "joint2", "-a*abs(dtheta2)", 0.5, {"fa1": 0.0, "fa2": 0.5}),
    ],
)
def test_a_friction_as_a_formula_is_that_friction(kind, target, formula, size, values):
    stated = looped(PAPER).with_effects([own(target, formula, a=size)])
    listed = looped(PAPER).with_effects([effect(kind)], values)
    assert apart(stated, listed) < SAME


CREEP = 2e-5
"""m or rad, in 0.3 s."""


def test_a_sign_as_a_formula_comes_near_to_coulomb_friction_where_it_is_steep():
    """A joint of the list is held at rest, one that a formula rubs creeps."""
    listed = looped(PAPER).with_effects([effect("coulomb_friction")], {"fc1": 0.0, "fc2": 0.5})
    near = [
        apart(
            looped(PAPER).with_effects([own("joint2", f"-a*tanh(dtheta2/{edge})", a=0.5)]), listed
        )
        for edge in (0.05, 0.0005)
    ]
    assert near[1] < min(CREEP, 0.3 * near[0])


def test_air_drag_as_two_formulas_is_air_drag():
    text = "-c*sqrt(dz1**2 + dz2**2 + 1e-12)*dz{}"
    pair = [
        own_effect(PAPER, f"tip{i}", text.format(i).replace("c*", f"c{i}*"),
                   (own_parameter(f"c{i}", 30.0),), f"own_{i}")
        for i in (1, 2)
    ]  # fmt: skip
    listed = looped(PAPER).with_effects([effect("air_drag")], {"cd": 30.0})
    assert apart(looped(PAPER).with_effects(pair), listed) < SAME


def test_a_formula_sees_other_joints_and_deflections():
    one = own("joint1", "-a*dtheta2 - b*delta1 + a*ddelta2*theta2", a=2.0, b=3.0)
    element = looped(PAPER).with_effects([one]).numbers().elements[0]
    assert one.ports[0] == "theta1"
    assert set(one.ports) == {"theta1", "theta2", "delta1", "delta2"}
    x = {"theta1": 0.1, "theta2": 0.2, "delta1": 0.3, "delta2": 0.4}
    v = {"theta1": 0.5, "theta2": 0.6, "delta1": 0.7, "delta2": 0.8}
    out = compile_law(element.law)(
        np.array([x[name] for name in one.ports]), np.array([v[name] for name in one.ports]),
        np.zeros(0), np.array(element.values),
    )  # fmt: skip
    assert out[0] == pytest.approx(-2.0 * 0.6 - 3.0 * 0.3 + 2.0 * 0.8 * 0.2, rel=1e-12)
    assert np.all(out[1:4] == 0.0)
    directions = dict(zip(one.ports, element.directions, strict=True))
    assert np.array_equal(directions["theta2"], [0.0, 1.0, 0.0, 0.0])
    assert directions["delta2"] == pytest.approx([0.0, 0.0, 0.0, 0.25])  # l^2 v


@pytest.mark.parametrize(
    "formula",
    [
        "-a*sign(dtheta1)*abs(theta1)",
        "-a*min(theta1, dtheta1)*max(theta1, 0.5)",
        "-a*atan2(dtheta1, 2 + theta1**2) + a*exp(-theta1**2)*log(2 + dtheta1**2)",
        "-a*sqrt(1 + theta1**2)*sinh(theta1)/cosh(dtheta1)",
        "-a*(1 + theta1**2)**1.5*tan(theta1)*acos(0.3*theta1)",
    ],
)
def test_slopes_are_those_of_the_force(formula):
    law = compile_law(own("joint1", formula, a=1.3).stated)
    rng = np.random.default_rng(3)
    for place, speed in rng.uniform(-1.0, 1.0, (5, 2)):

        def force(s: np.ndarray) -> np.ndarray:
            return law(s[:1], s[1:], np.zeros(0), np.array([1.3]))

        found = force(np.array([place, speed]))
        slopes = jacobian(force, np.array([place, speed]), 1e-4)[0]
        assert found[1:] == pytest.approx(slopes, abs=1e-7)


@pytest.mark.parametrize(
    ("target", "formula", "starts", "linear"),
    [
        ("joint1", "-a*dtheta1 - b*theta2", {"a": 1.0, "b": 1.0}, True),
        ("joint1", "-2*dtheta1", {}, True),
        ("joint1", "-a*dtheta1**3", {"a": 1.0}, False),
        ("joint1", "a", {"a": 1.0}, False),
        ("joint2", "-a*abs(dtheta1)", {"a": 1.0}, False),
        ("tip1", "-a*dz1", {"a": 1.0}, False),
    ],
)
def test_a_linear_formula_stays_in_the_linear_model(target, formula, starts, linear):
    one = own(target, formula, **starts)
    assert one.linear == linear
    level = looped(PAPER, level="lpv").with_effects([one]).level
    assert level == ("lpv" if linear else "nonlinear")


def test_a_linear_formula_has_its_slopes_in_the_linear_model():
    model = looped(PAPER, level="lpv").with_effects(
        [own("joint1", "-a*dtheta2 - b*theta1", a=4.0, b=2.0)]
    )
    K, D = linear_matrices(model.numbers().elements, np.zeros(4))
    assert K[0, 0] == pytest.approx(2.0) and np.count_nonzero(K) == 1
    assert D[0, 1] == pytest.approx(4.0) and np.count_nonzero(D) == 1


@pytest.mark.parametrize(
    ("formula", "starts", "sizes"),
    [
        ("-a*tanh(dtheta1/b)", {"a": 1.0, "b": 0.1}, {"a"}),
        ("-a*dtheta1 - b*dtheta1**3", {"a": 1.0, "b": 1.0}, {"a", "b"}),
        ("a*(exp(b*theta1) - 1)*dtheta1", {"a": 1.0, "b": 1.0}, {"a"}),
        ("exp(b*theta1) - 1", {"b": 1.0}, {"b"}),
        ("-a*sin(n*theta1 + p)", {"n": 7.0, "p": 0.0, "a": 1.0}, {"a"}),
    ],
)
def test_the_size_of_an_effect_is_what_makes_it_vanish(formula, starts, sizes):
    one = own("joint1", formula, **starts)
    quantities = {k.parameter.name: k for k in one.own_parameters}
    assert {name for name, k in quantities.items() if not k.secondary} == sizes
    neutral = {name: 0.0 if name in sizes else value for name, value in starts.items()}
    assert looped(PAPER).with_effects([one], neutral).effects == ()


def test_own_effects_and_listed_ones_are_added():
    one = own("joint1", "-a*dtheta1", a=3.0)
    friction = effect("viscous_friction")
    both = looped(PAPER).with_effects([one, friction], {"fv1": 4.0, "fv2": 0.0})
    alone = looped(PAPER).with_effects([friction], {"fv1": 7.0, "fv2": 0.0})
    assert apart(both, alone) < SAME


def test_an_own_effect_survives_a_change_of_the_arm():
    one = own("joint1", "-a*delta1", a=3.0)
    model = looped(PAPER).with_effects([one, effect("extra_bending_mode")])
    assert model.numbers().elements[0].directions[1].shape == (6,)


HEAD = 'title = "own"\n[arm]\npreset = "paper"\n[drive]\ngains = [60.0, 30.0]\n'


def scenario(target: str, formula: str, parameters: str, more: str = "") -> str:
    return (
        f'{HEAD}[[model.own]]\ntarget = "{target}"\nformula = "{formula}"\n'
        f"parameters = {{{parameters}}}\n{more}"
    )


REFUSED = """
torque1 | -a*dtheta1 | a = 1.0
joint3 | -a*dtheta1 | a = 1.0
joint1 | -a*dtheta3 | a = 1.0
joint1 | -a*dz1 | a = 1.0
joint1 | -a*b | a = 1.0
joint1 | -a*dtheta1 | a = 1.0, b = 2.0
joint1 | -m1*dtheta1 | m1 = 1.0
joint1 | -theta1*dtheta1 | theta1 = 1.0
joint1 | -sin*dtheta1 | sin = 1.0
joint1 | -a*dtheta1 | "a b" = 1.0
joint1 | -a*dtheta1 | a = {unit = 'N m'}
joint1 | -a*dtheta1 | a = 0.0
joint1 | a - a | a = 1.0
joint1 | 1 + a*theta1 | a = 1.0
joint1 | a/theta1 | a = 1.0
tip1 | -a*sqrt(dz1**2 + dz2**2)*dz1 | a = 1.0
joint1 | __import__ | a = 1.0
joint1 | -a*friction(theta1)*hysteresis(theta1, 0.1) | a = 1.0
joint1 | -a*friction(theta2) | a = 1.0
joint1 | -a*friction(theta1)*theta2 | a = 1.0
joint1 | spline(theta1, 1, -1, a, a, a) | a = 1.0
joint1 | spline(theta1, -1, 1, a) | a = 1.0
joint1 | a*friction(theta1, 2) | a = 1.0
joint1 | a*warmth | a = 1.0
z1 | a*z3 | a = 1.0
z1 | a*theta1 | a = 1.0
z1 | a*dz1 | a = 1.0
theta1 | a*u1 | a = 1.0
theta1 | a*friction(theta1) | a = 1.0
theta1 | a*hysteresis(theta1, 0.1) | a = 1.0
z1 | z1 + a*z2 | a = 1.0
z1 | a*z1 - a*z1 | a = 1.0
z1 | a*z1 | a = 1.0, b = 2.0
z1 | z1*z2 | z1 = 1.0
z1 | spline(z1, 1, 0, a, a, a) | a = 1.0
z3 | a*z1 | a = 1.0
"""
AGAIN = '[[model.own]]\ntarget = "joint2"\n'
TWICE = (
    'id = "air_drag"',
    f'{AGAIN}formula = "-a*theta2"\nparameters = {{a = 1.0}}',
    f'{AGAIN}id = "own_1"\nformula = "-b*theta2"\nparameters = {{b = 1.0}}',
)
"""Further lines of an effect whose id and parameter are taken."""


def test_what_is_wrong_with_an_own_effect_is_told() -> None:
    cases = [(line, scenario(*line.split(" | "))) for line in REFUSED.strip().splitlines()]
    letters = [f"a{k}" for k in range(21)]
    cases.append(("21 parameters", scenario(
        "joint1", "*".join(letters), ",".join(f"{x}=1" for x in letters)
    )))  # fmt: skip
    cases += [(more, scenario("joint1", "-a*dtheta1", "a = 1.0", more)) for more in TWICE]
    told = []
    for case, text in cases:
        said = refusal(lambda text=text: base_model(parse_scenario(text, "case.toml")))
        told.append(f"{case}\n  {said}")
    approved("own_effects_refused.txt", "\n".join(told))


def test_an_own_effect_can_be_hidden_in_a_recording_with_another_size():
    text = scenario("joint1", "-a*dtheta1", "a = 1.0") + (
        '[[recordings]]\nname = "a"\nsimulate = {theta2 = 1.0, seconds = 0.2}\n'
        'hidden = {own_1 = {a = 20.0}}\n[[recordings]]\nname = "b"\n'
        'simulate = {theta2 = 1.0, seconds = 0.2}\n'
    )  # fmt: skip
    stated = parse_scenario(text, "case.toml")
    model = base_model(stated)
    assert model.effect_values == {"a": 1.0}
    a, b = load_recordings(stated, model, None, None, Silent())  # type: ignore[arg-type]
    assert np.abs(a["theta1"] - b["theta1"]).max() > 1e-4
