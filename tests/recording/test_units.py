import math

import pytest

from flexgui.core.errors import InputError
from flexgui.core.recording.channels import CHANNEL_KINDS
from flexgui.core.units import factor_to_si, parse_header, quotient

ROUNDING = 1e-12
"""Relative; a factor is the product of a few rounded constants."""


@pytest.mark.parametrize(
    ("header", "name", "unit"),
    [
        ("theta1 [deg]", "theta1", "deg"),
        (" theta1[deg] ", "theta1", "deg"),
        ("theta1", "theta1", ""),
        ("u1 [N m]", "u1", "N m"),
        ("t []", "t", ""),
        ("a [b] c", "a [b] c", ""),
    ],
)
def test_header_splits_into_name_and_unit(header, name, unit):
    assert parse_header(header) == (name, unit)


@pytest.mark.parametrize(
    ("unit", "si_units", "factor"),
    [
        ("", ("rad",), 1.0),
        ("deg", ("rad", "m"), math.pi / 180),
        ("°", ("rad",), math.pi / 180),
        ("mm", ("rad", "m"), 1e-3),
        ("ms", ("s",), 1e-3),
        ("deg/s", ("rad/s", "m/s"), math.pi / 180),
        ("rpm", ("rad/s",), math.pi / 30),
        ("rev/min", ("rad/s",), math.pi / 30),
        ("mm/s", ("rad/s", "m/s"), 1e-3),
        ("Nm", ("N m", "N"), 1.0),
        ("N*m", ("N m", "N"), 1.0),
        ("N·m", ("N m", "N"), 1.0),
        ("mNm", ("N m", "N"), 1e-3),
        ("kN", ("N m", "N"), 1e3),
        ("kg m^2/s^2", ("N m",), 1.0),
        ("mA", ("A",), 1e-3),
        ("mm/m", ("rad", ""), 1e-3),
        ("percent", ("rad", ""), 1e-2),
    ],
)
def test_unit_has_its_factor_to_si(unit, si_units, factor):
    assert factor_to_si(unit, si_units) == pytest.approx(factor, rel=ROUNDING)


@pytest.mark.parametrize(
    ("unit", "si_units"),
    [
        ("m", ("rad",)),
        ("Hz", ("rad/s", "m/s")),  # revolutions or radians per second? it does not say
        ("rad", ("m",)),
        ("N", ("N m",)),
        ("degC", ("rad",)),
        ("1", ("rad",)),
    ],
)
def test_unit_of_the_wrong_dimension_is_refused(unit, si_units):
    with pytest.raises(InputError, match="does not fit"):
        factor_to_si(unit, si_units)


@pytest.mark.parametrize(
    "unit", ["foo", "2 m", "m**9**9**9", "99**99", "__import__('os')", "(", "-"]
)
def test_text_that_is_no_unit_is_refused(unit):
    with pytest.raises(InputError, match="is not known"):
        factor_to_si(unit, ("rad",))


@pytest.mark.parametrize("kind", CHANNEL_KINDS, ids=lambda kind: kind.pattern)
def test_the_si_units_of_every_channel_convert_to_themselves(kind):
    for unit in kind.units:
        assert factor_to_si(f"{unit} ".strip(), (unit,)) == 1.0
        assert factor_to_si(unit.replace(" ", "*"), kind.units) == pytest.approx(1.0, rel=ROUNDING)


@pytest.mark.parametrize(
    ("unit", "others", "written"),
    [
        ("N m", (), "N m"),
        ("N m", (("", 2.0),), "N m"),
        ("N m", (("rad/s", 1.0),), "N m s/rad"),
        ("N m", (("rad/s", 2.0),), "N m s^2/rad^2"),
        ("N m", (("rad/s", 1.0), ("rad", 1.0)), "N m s/rad^2"),
        ("N", (("m", 1.0), ("s", 1.0)), "N/(m s)"),
        ("m", (("m", 1.0),), ""),
        ("", (("m", 3.0),), "1/m^3"),
    ],
)
def test_a_quotient_of_units_is_written_as_a_person_would(
    unit: str, others: tuple[tuple[str, float], ...], written: str
) -> None:
    assert quotient(unit, *others) == written
