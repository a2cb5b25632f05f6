"""How right a case is, and how it stands beside the stored reference: functions of plain values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from flexgui.core.effects import effect
from tests.programs.sample.cases import NOT_JUDGEABLE, OUTSIDE, Case

Record = Mapping[str, Any]

CLOSE, LOOSE = 0.02, 0.10
"""Relative errors of sizes that tell a good, a fair and a bad answer apart."""
FLOORS = 1.15
"""Times the noise floor: a final error that is asked for, and by how much one is worse."""
QUICKER = 1.3
"""Times, in CPU seconds: machines and their other work differ by a fifth."""

SHAPES = "extra_bending_mode"

BETTER, EQUAL, WORSE = "better", "equal", "worse"


def named(kinds: Sequence[str]) -> set[str]:
    """Ids without those that others of them include."""
    return set(kinds) - {part for kind in kinds for part in effect(kind).includes}


def is_right(case: Case, record: Record) -> bool:
    """Whether just what is hidden is named; outside the catalogue, that the verdict says so."""
    if "kept" not in record:
        return False
    if NOT_JUDGEABLE in case.hidden:
        return bool(record["final_verdict"] == NOT_JUDGEABLE)
    if OUTSIDE in case.hidden:
        return not record["kept"] and record["final_verdict"] == "unlisted"
    listed = record["final_verdict"] == "nothing_missing"
    # More shapes than stated are a matter of resolution, and asked for where they were hidden.
    shapes = {SHAPES} & set(case.hidden) if record.get("shapes") else set()
    return listed and named(record["kept"]) | shapes == named(case.hidden)


def worst_size(case: Case, record: Record) -> float | None:
    """The largest relative error of the parameters whose truth is known; None: none was found."""
    values = record.get("values", {})
    errors = [
        abs(values[name] - true) / abs(true)
        for name, true in case.truth.items()
        if name in values and true
    ]
    return max(errors, default=None)


def grade(case: Case, record: Record) -> tuple[int, ...]:
    """Ordered: what is named, then sizes, then the final error; larger is better."""
    size, error = worst_size(case, record), record.get("error")
    return (
        int("kept" in record),
        int(is_right(case, record)),
        0 if size is None else 1 + int(size <= LOOSE) + int(size <= CLOSE),
        int(error is not None and error <= FLOORS),
    )


def compare(case: Case, record: Record, reference: Record) -> str:
    """BETTER, EQUAL or WORSE than the reference."""
    now, before = grade(case, record), grade(case, reference)
    if now != before:
        return BETTER if now > before else WORSE
    return EQUAL


def pace(record: Record, reference: Record) -> str:
    """Said where a case takes clearly more or less time than in the reference."""
    now, before = record["cpu"], reference["cpu"]
    if now > QUICKER * before:
        return "slower"
    return "quicker" if before > QUICKER * now else ""


def line(case: Case, record: Record, reference: Record | None) -> str:
    """One case in one line."""
    named_or_why = "+".join(record["kept"]) or "nothing" if "kept" in record else record["failed"]
    size, error = worst_size(case, record), record.get("error")
    parts = [
        f"{case.name:44.44s}",
        "right" if is_right(case, record) else "WRONG",
        f"{record.get('final_verdict') or '-':16s}",
        "sizes      -" if size is None else f"sizes {100.0 * size:5.1f} %",
        "error    -" if error is None else f"error {error:4.2f}",
        f"{record['cpu']:5.0f} s",
    ]
    if reference is not None:
        parts += [f"{compare(case, record, reference):6s}", f"{pace(record, reference):7s}"]
    return "  ".join(parts) + f"  {named_or_why}"


def summary(
    cases: Mapping[str, Case], records: Mapping[str, Record], reference: Mapping[str, Record]
) -> str:
    """Sums over all cases, and what changed."""
    known = [n for n in records if n in reference]
    verdicts = {n: compare(cases[n], records[n], reference[n]) for n in known}
    lines = [_sums("now", cases, records), _sums("reference", cases, reference)]
    for word in (BETTER, WORSE):
        names = [n for n in known if verdicts[n] == word]
        lines.append(f"{word}: {len(names)}" + "".join(f"\n  {n}" for n in names))
    if known:
        lines.append(f"as a whole: {_whole(list(verdicts.values()))} than the reference")
    return "\n".join(lines).replace(f"{EQUAL} than", f"{EQUAL} to")


def _whole(verdicts: Sequence[str]) -> str:
    if WORSE in verdicts:
        return WORSE
    return BETTER if BETTER in verdicts else EQUAL


def _sums(what: str, cases: Mapping[str, Case], records: Mapping[str, Record]) -> str:
    right = sum(is_right(cases[n], r) for n, r in records.items() if n in cases)
    close = sum(
        (size := worst_size(cases[n], r)) is not None and size <= CLOSE
        for n, r in records.items() if n in cases
    )  # fmt: skip
    cpu = sum(r["cpu"] for r in records.values())
    return (
        f"{what + ':':10s} {right} of {len(records)} right, sizes within "
        f"{100.0 * CLOSE:.0f} % in {close}, {cpu:.0f} s of CPU"
    )
