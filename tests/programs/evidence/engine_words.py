"""How the cases of the independent engine are judged, and the section that says so."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from typing import Any

from tests.programs.evidence.frame import table

SIZE, FRICTION = 0.05, 0.08
"""Relative, of the issue: how near a size is asked to be, and one of dry friction."""
DRY = ("coulomb_friction", "stribeck_friction", "load_friction", "presliding_friction")

STANDS_FOR = {"stribeck_friction": ("coulomb_friction",)}
"""The level below a bulge has a name of its own in the catalogue; both are hidden, either may come
first."""

Found = Mapping[str, Any]

ABOUT = """\
Chains of ten rigid bodies per link on elastic hinges in MuJoCo, in their velocity loops. There \
are four arms: the paper's arm, one with unequal links (lengths 7 : 4, stiffnesses 6 : 1), one \
link, and three. Dry friction as a constraint, springs, dampers and gravity are the engine's own. \
Other effects are applied between two of its steps of 20 µs. Each effect has three sizes; there \
are pairs and triples. Each case has three recordings of 1.5 s and one to validate. Both \
stiffnesses are stated 30 % off. The diagnosis sees the files, the loops' gains, the rotors and \
the drawing. A size counts as right within 5 %, one of dry friction within 8 %."""


def allowed(truth: Found) -> set[str]:
    """What may come first."""
    return {name for kind in truth for name in (kind, *STANDS_FOR.get(kind, ()))}


def first_right(one: Found) -> bool:
    """Nothing where nothing is hidden."""
    return one["first"] in allowed(one["truth"]) if one["truth"] else one["first"] is None


def set_right(one: Found) -> bool:
    """Whether just what is hidden is in the final model."""
    named = set(one["named"])
    return set(one["truth"]) <= named <= allowed(one["truth"])


def misses(one: Found) -> Iterator[tuple[str, float]]:
    """Sizes of the effects that were named, and their relative errors, beyond what is asked."""
    for kind, sizes in one["truth"].items():
        most = FRICTION if kind in DRY else SIZE
        for name, true in sizes.items():
            error = abs(one["values"].get(name, 0.0) / true - 1.0)
            if kind in one["named"] and error > most:
                yield name, error


def text(found: Mapping[str, Found], cases: Collection[str]) -> str:
    """Markdown; `cases` are the names of all, `arm/what is hidden`."""
    if not found:
        return ABOUT
    arms = list(dict.fromkeys(name.partition("/")[0] for name in cases))
    groups = [list(cases), *([n for n in cases if n.startswith(f"{arm}/")] for arm in arms)]
    columns = [_shares(found, group) for group in groups]
    rows = [[words, *shares] for words, *shares in zip(COUNTED, *columns, strict=True)]
    run = f"{len(found)} of {len(cases)} cases have a result; one without counts as not right."
    texts = [ABOUT, run, table(("", "all arms", *arms), rows)]
    wrong = [f"- {_said(name, one)}" for name, one in found.items() if not set_right(one)]
    far = [f"- {name}: {_far(one)}" for name, one in found.items()
           if set_right(one) and list(misses(one))]  # fmt: skip
    texts += ["**Named wrongly**\n\n" + "\n".join(wrong)] if wrong else []
    texts += ["**Named rightly, but a size is off**\n\n" + "\n".join(far)] if far else []
    return "\n\n".join([*texts, _every(found)])


COUNTED = (
    "an effect that is hidden comes first",
    "just what is hidden is named in the end",
    "of these, every size as near as asked",
    "nothing hidden, nothing named",
)


def _shares(found: Mapping[str, Found], names: Collection[str]) -> list[str]:
    """Of each of COUNTED."""
    hidden = [found.get(name) for name in names if not name.endswith("/nothing")]
    bare = [found.get(name) for name in names if name.endswith("/nothing")]
    named = [one for one in hidden if one and set_right(one)]
    return [
        _share(bool(one) and first_right(one) for one in hidden),
        _share(bool(one) and set_right(one) for one in hidden),
        _share(not list(misses(one)) for one in named),
        _share(bool(one) and set_right(one) for one in bare),
    ]


def _share(right: Iterable[bool]) -> str:
    each = list(right)
    return f"{sum(each)} of {len(each)}" if each else "–"


def _said(name: str, one: Found) -> str:
    named = ", ".join(one["named"]) or "nothing"
    added = [kind for kind in one["added"] if kind]  # a step that takes one out adds none
    came = f", after {', '.join(added)}" if set(added) != set(one["named"]) else ""
    tip = f"; tip error {_tip(one)} mm" if one["tip_mm"] else ""
    return f"{name}: named {named}{came}{tip}; verdict on what remains: {one['final_verdict']}"


def _far(one: Found) -> str:
    return ", ".join(f"{name} {100 * error:.0f} %" for name, error in misses(one))


def _tip(one: Found) -> str:
    return f"{one['tip_mm'][0]:.2f} → {one['tip_mm'][-1]:.2f}"


def _every(found: Mapping[str, Found]) -> str:
    rows = [
        [
            name.replace("+", " + "), one["first"] or "–", "yes" if set_right(one) else "NO",
            _worst(one), _tip(one),
        ]
        for name, one in found.items()
    ]  # fmt: skip
    head = ("case", "first", "named right", "worst size", "tip error, mm")
    return table(head, rows)


def _worst(one: Found) -> str:
    errors = [
        abs(one["values"][name] / true - 1.0)
        for sizes in one["truth"].values()
        for name, true in sizes.items()
        if name in one["values"]
    ]
    return f"{100 * max(errors):.1f} %" if errors else "–"
