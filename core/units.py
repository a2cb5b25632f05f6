"""Units as people write them in the headings of files."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

from .errors import InputError

if TYPE_CHECKING:
    from pint import UnitRegistry


_HEADER = re.compile(r"^(?P<name>[^\[\]]*)\[(?P<unit>[^\[\]]*)\]$")
_ROUND = re.compile(r"^(?P<name>[^()\[\]]*\S)\s*\((?P<unit>[^()\[\]]+)\)$")
_ALLOWED = re.compile(r"[A-Za-zµμΩε°²³·%/*^()\-. 1-9]{1,40}")
"""Letters, signs and single digits: no unit needs more, and a tower of powers takes for ever."""
_SPELLINGS = (
    (re.compile(r"\b([mkMuµ]?N)\s*[.·]?\s*m\b"), r"\1*m"),  # pint reads 'Nm' as 'number metre'
    (re.compile(r"\brev\b"), "revolution"),
    (re.compile(r"\bOhm\b"), "ohm"),
    (re.compile(r"^([mµμun]?)(ε|strain)$"), r"\1m/m"),
    (re.compile(r"^microstrain$"), "um/m"),
    (re.compile(r"\bs2\b"), "s^2"),
)
STANDARD_GRAVITY = 9.80665
"""m/s²"""
_TOWER = re.compile(r"[1-9]{2}|(\*\*|\^)[^*^/]*(\*\*|\^)")


def parse_header(header: str) -> tuple[str, str]:
    """`theta1 [deg]` or `theta1 (deg)` as ("theta1", "deg"); without a unit it is ""."""
    text = header.strip()
    match, other = _HEADER.match(text), _ROUND.match(text)
    if match is None and other is not None and is_unit(other["unit"].strip()):
        match = other
    return (text, "") if match is None else (match["name"].strip(), match["unit"].strip())


def factor_to_si(unit: str, si_units: Sequence[str]) -> float:
    """The factor that turns a value in `unit` into SI; InputError for a unit that does not fit.

    `si_units` are the units that the channel may have, such as ("rad", "m") for a joint that may
    turn or slide. Angles count as a dimension of their own, so that 1/s is not taken for rad/s.
    No unit at all means SI.
    """
    if not unit or unit in si_units:
        return 1.0
    if unit == "g" and "m/s²" in si_units:
        return STANDARD_GRAVITY  # of an accelerometer, not the gram
    factor, root = _root(unit)
    for si_unit in si_units:
        si_factor, si_root = _root(si_unit)
        if root == si_root:
            return factor / si_factor
    expected = " or ".join(name or "a plain ratio" for name in si_units)
    raise InputError(f"the unit [{unit}] does not fit, it must be convertible to {expected}")


def is_unit(text: str) -> bool:
    """Whether the text is a unit; no text is none."""
    try:
        return bool(text) and bool(_root(text))
    except InputError:
        return False


def same_unit(one: str, other: str) -> bool:
    """Whether two texts are one unit, as `deg/s` and `°/s` are."""
    return one == other or (is_unit(one) and is_unit(other) and _root(one) == _root(other))


_BASE = {"gram": "kg", "meter": "m", "second": "s", "ampere": "A", "kelvin": "K", "radian": "rad"}


def base_units(unit: str) -> tuple[float, dict[str, int]]:
    """The factor to SI, and the exponents of kg, m, s, A, K and rad.

    Raises:
        InputError: Where the text is no unit, or one of anything else.
    """
    factor, root = _root(unit)
    exponents: dict[str, int] = {}
    for divides, name, power in re.findall(r"(/ )?\b([a-z_]+)(?: \*\* (\d+))?", root):
        if name in _BASE and "." not in root:
            exponents[_BASE[name]] = int(power or 1) * (-1 if divides else 1)
        elif name != "dimensionless":
            raise InputError(f"the unit [{unit}] is not one of mechanics")
    return factor / 1000.0 ** exponents.get("kg", 0), exponents


@cache
def _root(unit: str) -> tuple[float, str]:
    """(factor, base units) of a unit in pint's base units, in which the radian stays visible."""
    if not unit:
        return 1.0, "dimensionless"
    if not _ALLOWED.fullmatch(unit) or _TOWER.search(unit):
        raise InputError(f"the unit [{unit}] is not known, write it like [deg], [mm] or [N m]")
    text = unit
    for pattern, replacement in _SPELLINGS:
        text = pattern.sub(replacement, text)
    try:
        # pint raises a dozen kinds of errors on text that is not a unit, tokenizer's included.
        factor, root = _registry().get_root_units(_registry().parse_units(text))
    except Exception:
        raise InputError(
            f"the unit [{unit}] is not known, write it like [deg], [mm] or [N m]"
        ) from None
    return float(factor), str(root)  # type: ignore[arg-type]


@cache
def _registry() -> UnitRegistry[Any]:
    # Imported late: reading pint's table of units takes a fifth of a second.
    from pint import UnitRegistry

    return UnitRegistry()


def quotient(unit: str, *others: tuple[str, float]) -> str:
    """A unit over powers of others, such as N m s^2/rad^2; empty ones do not count."""
    powers = dict[str, float]()
    for text, power in ((unit, 1.0), *((text, -power) for text, power in others)):
        for k, part in enumerate(text.split("/")):
            for factor in part.strip("()").split():
                name, _, own = factor.partition("^")
                powers[name] = powers.get(name, 0.0) + (-power if k else power) * float(own or 1)
    above, below = (
        [
            name if abs(p) == 1.0 else f"{name}^{abs(p):g}"
            for name, p in powers.items()
            if sign * p > 0.0
        ]
        for sign in (1.0, -1.0)
    )
    over = f"/({' '.join(below)})" if len(below) > 1 else f"/{below[0]}" if below else ""
    return (" ".join(above) or ("1" if over else "")) + over
