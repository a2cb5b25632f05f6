"""The frame of the evidence: parts alone, resumable, honest about what is missing."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.evidence.emps_rules import (
    ESTIMATED,
    JUDGED,
    Table,
    free_run,
    inverse_model,
    loop_of,
)
from tests.evidence.frame import PAGE, answer_text, cases, missing, page, parts, run

pytestmark = pytest.mark.long

MASS, VISCOUS, KP, GAIN, VOLT = 95.0, 200.0, 150.0, 9000.0, 40.0
"""Of a slide without dry friction, whose motion is known in closed form."""
RECOVERED = 0.01
"""Relative: what smoothing and differences cost at 100 Hz."""
ENDS = 3.0
"""Per cent of the force that zero-phase filters and differences lose at the ends of 6 s."""
SAMPLES, STEP = 6000, 1e-3
STRAIGHT = 1e-3
"""m over 6 s: a straight line through 20 samples of a sine starts the run a little off."""


def slide(pulses: bool = False) -> Table:
    """A sine of 0.5 Hz, its force, and the reference with which a loop would have made it."""
    t = STEP * np.arange(SAMPLES)
    w = np.pi
    q, v, a = 0.1 * np.sin(w * t), 0.1 * w * np.cos(w * t), -0.1 * w**2 * np.sin(w * t)
    force = MASS * a + VISCOUS * v
    pulse = 5.0 * (t % 1.0 > 0.5) if pulses else np.zeros(SAMPLES)
    return Table(t, q + ((force - VOLT * pulse) / GAIN + v) / KP, q, force, pulse)


def written(folder: Path) -> Path:
    for name, data in ((ESTIMATED, slide()), (JUDGED, slide(True))):
        content = {"t": data.time, "q_ref": data.q_ref, "q": data.q, "force": data.force}
        if data.pulse.any():
            content["pulse"] = data.pulse
        pd.DataFrame(content).to_csv(folder / name, index=False)
    return folder


@pytest.mark.parametrize("name", parts())
def test_a_part_keeps_its_contract(name: str) -> None:
    part = parts()[name]
    assert part.TITLE
    assert isinstance(part.ORDER, int)
    assert isinstance(part.FILES, tuple)
    assert all(callable(work) for work in part.CASES.values())


def test_without_recordings_a_part_says_what_is_missing(tmp_path: Path) -> None:
    text = page(tmp_path, tmp_path / "nothing.jsonl")
    for part in parts().values():
        assert f"## {part.TITLE}\n" in text
        for name in missing(part, tmp_path):
            assert name in text
    assert cases(["emps"], None) == cases(["emps"], tmp_path) == []
    assert "set FLEXGUI_DATA" in text


def test_what_was_found_is_not_looked_for_again(tmp_path: Path) -> None:
    folder, journal = written(tmp_path), tmp_path / "evidence.jsonl"
    (case,) = cases(["peers"], folder)
    record = answer_text(json.dumps(asdict(case)))
    journal.write_text(record + "\n" + record[: len(record) // 2], encoding="utf-8")  # killed
    said: list[str] = []
    run(["peers"], folder, journal, 1, said.append)
    assert said == ["1 cases, 1 of them finished before."]
    text = page(folder, journal)
    assert "| symmetric | " in text
    assert json.loads(record)["date"] in text
    assert "numpy" in text


def test_a_case_that_fails_is_named_with_its_reason(tmp_path: Path) -> None:
    folder, journal = written(tmp_path), tmp_path / "evidence.jsonl"
    (case,) = cases(["peers"], folder)
    (folder / ESTIMATED).write_text("t\n1\n")
    journal.write_text(answer_text(json.dumps(asdict(case))) + "\n", encoding="utf-8")
    assert "Failed: least_squares_emps: KeyError" in page(folder, journal)


def test_the_page_that_is_kept_has_every_part() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert [part.TITLE for part in parts().values() if f"## {part.TITLE}\n" not in text] == []


def test_the_loop_is_read_from_its_log() -> None:
    loop, missed = loop_of(slide(pulses=True))
    assert (loop.kp, loop.gain, loop.volt) == pytest.approx((KP, GAIN, VOLT), rel=RECOVERED)
    assert missed < ENDS


def test_the_inverse_model_gives_mass_and_friction_back() -> None:
    X, force = inverse_model(slide(), signs=False)
    found = np.linalg.lstsq(X, force)[0]
    assert found[:2] == pytest.approx([MASS, VISCOUS], rel=RECOVERED)


def test_a_free_run_at_the_true_values_follows_the_recording() -> None:
    values = {"m1": MASS, "fv1": VISCOUS}
    rms, error = free_run(values, [{"id": "viscous_friction", "fv1": None}], slide())
    assert rms < STRAIGHT
    assert len(error) == SAMPLES - 20


def test_a_part_that_was_not_run_here_stays_as_it_was(tmp_path: Path) -> None:
    part = parts()["real_rigs"]
    before = f"# Evidence\n\n## {part.TITLE}\n\nMeasured elsewhere.\n\n## Gone\n\nOld.\n"
    text = page(tmp_path, tmp_path / "nothing.jsonl", before)
    assert "Measured elsewhere." in text
    assert "Old." not in text
