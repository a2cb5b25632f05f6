"""What the data fix and leave free is found from the sensitivities."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.presets import presets
from flexgui.core.arm.segment import Segment
from flexgui.core.identify.fit import Fitted
from flexgui.core.identify.identifiability import (
    analyse,
    determined,
    identified,
    relative_scales,
    wider_than_value,
)
from flexgui.core.identify.unknowns import Unknown, Unknowns
from flexgui.core.parameters import Parameter
from flexgui.core.simulate.experiment import NoiseLevels
from flexgui.sentences.identifiability import STARTS_FREE, identifiability_sentences
from tests.helpers import looped
from tests.identify.helpers import BOX, LPV, clean, fit, noisy, simulated

EXACT = 1e-9

DIRECTION = 1e-4
"""Relative, of a null direction: truncation of the differences."""

NAMES = "abcdefgh"


def named(names: str, value: float = 1.0) -> Unknowns:
    """Positive parameters of one letter each."""
    return Unknowns(tuple(Unknown(Parameter(n, value, "", 0.1, 10.0)) for n in names))


def noisy_fit(*parameters: str, count: int = 3, **settings) -> Fitted:  # type: ignore[no-untyped-def]
    return fit(LPV, noisy(clean()[:count], 20.0, 1), parameters=parameters,
               **{"output": ("ydot",), **settings})  # fmt: skip


def said(fitted: Fitted) -> tuple[str, ...]:
    return identifiability_sentences(fitted.fit)


def test_everything_is_fixed_where_it_is():
    fitted = noisy_fit("EI1", "EI2")
    assert said(fitted) == ("All estimated parameters are identifiable.",)
    assert fitted.fit.identifiability.rank == 2
    assert fitted.fit.identifiability.valley is None
    assert all(e.identifiable and np.isfinite(e.std) for e in fitted.fit.estimates)


def test_first_states_of_recordings_are_said_as_one():
    """Where the arm stands is not seen by velocities, and no recording's is spelt out."""
    fitted = noisy_fit("EI1", "EI2", initial_state=True)
    assert any(not e.identifiable for e in fitted.fit.estimates if e.name == "start_theta1")
    assert said(fitted) == ("All estimated parameters are identifiable.", STARTS_FREE)


def test_a_parameter_without_influence_is_named():
    slide = looped(presets()["single_axis"], 500.0)
    recordings = simulated(slide, points=[0.0], seconds=0.5, amplitude=0.1, level="nonlinear")
    fitted = fit(slide, recordings, parameters=("m1", "l1"), output=("encoder",))
    assert said(fitted) == ("The data say nothing about l1.",)
    assert [e.identifiable for e in fitted.fit.estimates] == [True, False]


def test_data_that_show_nothing_say_so_of_each():
    unknowns = named("ab")
    rank, values, null = analyse(unknowns, np.ones(2), np.zeros((50, 2)))
    assert rank == 0
    assert np.all(values == 0.0)
    assert np.abs(null).max(axis=1).tolist() == [1.0, 1.0], "each by itself"


def test_masses_stiffness_and_gains_scale_together():
    names = ("m1", "m2", "EI1", "EI2", "lambda1", "lambda2")
    fitted = noisy_fit(*names)
    found = fitted.fit.identifiability
    assert found.rank == len(names) - 1
    assert len(found.null_directions) == 1
    relative = found.null_directions[0] / found.null_directions[0][0]
    assert relative == pytest.approx(np.ones(len(names)), rel=DIRECTION)
    assert not any(e.identifiable for e in fitted.fit.estimates)
    text = said(fitted)[0]
    assert text.startswith("The data do not distinguish m1, m2, EI1, EI2, λ1 and λ2")
    assert text.count("+1.00 %") == len(names) or text.count("-1.00 %") == len(names)
    assert found.valley is None


def test_one_known_scale_frees_the_others():
    fitted = noisy_fit("m1", "m2", "EI1", "EI2")
    assert all(e.identifiable for e in fitted.fit.estimates)


def test_parameters_of_a_recording_are_named_with_it():
    settings = {"parameters": ("epsilon",), "per_recording": ("d",), "output": ("ydot",)}
    fitted = fit(LPV, noisy(clean()[:2], 20.0, 1), **settings)
    text = said(fitted)[0]
    assert all(name in text for name in ("ε", "d (th1)", "d (th2)"))
    assert fitted.fit.identifiability.rank == 2


@settings(max_examples=60)
@given(st.integers(1, 6), st.integers(0, 5), st.integers(0, 10_000))
def test_rank_and_null_space_are_those_of_the_sensitivities(count, missing, seed):
    assume(missing <= count)
    rng = np.random.default_rng(seed)
    hidden = np.linalg.qr(rng.standard_normal((count, count)))[0][:, :missing]
    J = rng.standard_normal((60, count)) @ (np.eye(count) - hidden @ hidden.T)
    if missing == count:
        J[:] = 0.0
    rank, values, null = analyse(named(NAMES[:count]), np.ones(count), J)
    assert rank == count - missing
    assert null.shape == (missing, count)
    assert np.all(np.diff(values) <= 0.0)
    assert np.linalg.norm(null, axis=1) == pytest.approx(np.ones(missing))
    assert np.abs(J @ null.T).max(initial=0.0) < EXACT * max(np.abs(J).max(), 1.0) * 1e3
    assert not missing or np.linalg.matrix_rank(null) == missing


@settings(max_examples=30)
@given(st.integers(0, 10_000), st.lists(st.floats(1e-6, 1e9), min_size=3, max_size=3))
def test_units_do_not_change_what_is_identifiable(seed, sizes):
    rng = np.random.default_rng(seed)
    J = rng.standard_normal((40, 3))
    J[:, 2] = J[:, 0]
    value = np.array(sizes)
    unknowns = Unknowns(
        tuple(
            Unknown(Parameter(n, v, "", v / 10, v * 10, scale=v))
            for n, v in zip("abc", sizes, strict=True)
        )
    )
    rank, _, null = analyse(unknowns, value, J / value)
    assert rank == 2
    assert np.abs(null[0]) == pytest.approx([np.sqrt(0.5), 0.0, np.sqrt(0.5)], abs=1e-6)
    assert identified(null, 3).tolist() == [False, True, False]


def test_the_valley_stays_in_the_box_and_passes_through_the_estimate():
    fitted = noisy_fit("epsilon", "d", bounds=BOX)
    found = fitted.fit.identifiability.valley
    assert found is not None
    low, high = np.array([BOX[n] for n in found.names]).T
    reach = (found.points - low) / (high - low)
    assert reach.min() > -1e-9
    assert reach.max() < 1.0 + 1e-9
    ends = np.sort(np.concatenate([reach[0], reach[-1]]))
    assert ends[0] == pytest.approx(0.0, abs=1e-6) or ends[-1] == pytest.approx(1.0, abs=1e-6)
    distance = np.linalg.norm(found.points / fitted.vector - 1.0, axis=1)
    assert (
        distance.min() < np.linalg.norm(np.diff(found.points / fitted.vector, axis=0), axis=1).max()
    )


def test_the_valley_is_flat_where_offsets_are_estimated_too():
    recordings = noisy(clean()[:3], 20.0, 1)
    moved = [r.channels["ydot1"] for r in recordings]
    for values in moved:
        values += 0.2
    fitted = fit(LPV, recordings, parameters=("epsilon", "d"), bounds=BOX, offsets=("ydot1",),
                 output=("ydot",))  # fmt: skip
    found = fitted.fit.identifiability.valley
    assert found is not None
    assert found.cost_ratio == pytest.approx(np.ones(len(found.points)), abs=1e-6)


def test_a_quantity_that_may_vanish_is_relative_to_itself_unless_it_nearly_does():
    gains = Unknowns(tuple(Unknown(Parameter(n, 60.0, "", 0.0, 600.0, scale=60.0)) for n in "abc"))
    found = relative_scales(gains, np.array([90.0, 0.0, 1e-6]))
    assert found.tolist() == [90.0, 60.0, 60.0]


def test_two_parameters_of_one_law_are_not_determined():
    """Differences leave a hundred-thousandth between their columns, which no rank shows."""
    rng = np.random.default_rng(3)
    column = rng.standard_normal((400, 1))
    J = np.hstack([column, column + 1e-4 * rng.standard_normal((400, 1))])
    cov = 0.01**2 * np.linalg.inv(J.T @ J)
    unknowns, at = named("ab", 5.0), np.full(2, 5.0)
    _, _, null = analyse(unknowns, at, J)
    assert not len(null)
    assert not determined(unknowns, at, cov, null).any()


def test_a_deviation_larger_than_the_value_determines_nothing():
    unknowns, at = named("ab", 1.0), np.ones(2)
    cov, null = np.diag([817.0**2, 0.1**2]), np.zeros((0, 2))
    assert determined(unknowns, at, cov, null).tolist() == [False, True]
    assert wider_than_value(unknowns, at, cov).tolist() == [True, False]


TRUE = {"xc1": 0.21, "Jc1": 0.09, "xc2": 0.16, "Jc2": 0.03}
"""m and kg m²; the uniform beams from which the fits begin have 0.25, 0.083, 0.2 and 0.027."""

DEVIATIONS, KNOWN = 4.0, 0.05
"""An estimate is nearer to the truth than that, in standard deviations, and they are at most this
share of it: one that states no deviation is no success."""


def arm(upright: bool, *stated: dict[str, float]) -> Arm:
    sizes = ({"length": 0.5, "mass": 4.0}, {"length": 0.4, "mass": 2.0})
    tables = stated or ({}, {})
    links = tuple(
        Segment(**size, **table, modes=0, hub_inertia=0.03)
        for size, table in zip(sizes, tables, strict=True)
    )
    return Arm(segments=links, gravity=(0.0, -9.81 if upright else 0.0))


def fitted(upright: bool) -> Fitted:
    """Of two recordings with the noise of an encoder."""
    links = [{"centre_of_mass": TRUE[f"xc{k}"], "inertia": TRUE[f"Jc{k}"]} for k in (1, 2)]
    recordings = simulated(
        looped(arm(upright, *links), 20.0), points=(0.8, 2.0), seconds=2.0, amplitude=1.0,
        noise=NoiseLevels({"encoder": 1e-4}),
    )  # fmt: skip
    return fit(looped(arm(upright), 20.0), recordings, parameters=tuple(TRUE), output=("encoder",))


def test_gravity_tells_centre_and_inertia_apart() -> None:
    found = fitted(upright=True).fit
    assert identifiability_sentences(found) == ("All estimated parameters are identifiable.",)
    for e in found.estimates:
        assert abs(e.value - TRUE[e.name]) < DEVIATIONS * e.std
        assert e.std < KNOWN * TRUE[e.name]


def test_without_gravity_the_first_links_are_one_number() -> None:
    """Its inertia about the joint, J_c + m x_c², and the second link's apart."""
    found = fitted(upright=False).fit
    told = identifiability_sentences(found)[0]
    assert "xc1 and Jc1" in told and "xc2" not in told
    assert [e.identifiable for e in found.estimates] == [False, False, True, True]
    value = {e.name: e.value for e in found.estimates}
    about_joint = value["Jc1"] + 4.0 * value["xc1"] ** 2
    assert about_joint == pytest.approx(TRUE["Jc1"] + 4.0 * TRUE["xc1"] ** 2, rel=KNOWN)
    assert np.isfinite([e.std for e in found.estimates[2:]]).all()
