"""The blind matrix: `python -m tests.studies.blind`, resumable, and its tables.

Every applicable effect is hidden at two sizes under white and coloured noise, then pairs, nothing,
and disturbances that no effect describes; the diagnosis knows nothing of it. The results stand in
one file, a line per case: the same command goes on where it was stopped.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from core.effects import catalogue
from core.errors import InputError
from core.resumable.executor import WORKERS
from core.sentences import did_you_mean
from core.study.rig import COLOURS
from tests.studies.blind_case import answer_text
from tests.studies.blind_cases import PARTS, Choice
from tests.studies.blind_run import run_study, study_parser
from tests.studies.blind_tables import tables
from tests.studies.outside import OUTSIDE

OUT = Path("reports/blind.jsonl")


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs what is asked for and prints the tables; 2 for bad input."""
    asked = _parser().parse_args(arguments)
    try:
        choice = Choice(
            parts=_listed(asked.part, PARTS, "--part") or PARTS,
            effects=_listed(asked.effects, (*catalogue(), *OUTSIDE), "--effects"),
            seeds=asked.seeds,
            noises=_listed(asked.noise, COLOURS, "--noise") or tuple(COLOURS),
            levels=tuple(asked.level.split(",")) if asked.level else (),
        )
        return run_study(choice.cases(), answer_text, tables, asked)
    except InputError as error:
        print(error, file=sys.stderr)
        return 2


def _listed(text: str | None, known: Iterable[str], option: str) -> tuple[str, ...]:
    names = tuple(name for name in (text or "").split(",") if name)
    for name in names:
        if name not in known:
            raise InputError(f"{option}: {name!r} is not known; {did_you_mean(name, known)}")
    return names


def _parser() -> argparse.ArgumentParser:
    parser = study_parser("blind", OUT, "--processes", WORKERS)
    parser.description = __doc__
    parser.add_argument("--part", help=f"some of {', '.join(PARTS)}; all by default")
    parser.add_argument("--effects", help="ids of effects or disturbances; all by default")
    parser.add_argument("--seeds", type=int, help="fewer or more seeds (pairs, nulls) than planned")
    parser.add_argument("--noise", help=f"some of {', '.join(COLOURS)}; all by default")
    parser.add_argument("--level", help="weak, strong or switched; all by default")
    return parser


if __name__ == "__main__":
    raise SystemExit(main())
