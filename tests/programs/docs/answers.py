"""The teacher's answers, computed.

`python -m tests.programs.docs.answers` writes docs/teaching/answers.md.

Numbers have as many digits as another machine repeats.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from pathlib import Path

import flexgui as fg
from flexgui.core.challenge.challenge import make_challenge
from flexgui.core.progress import Silent
from flexgui.core.results import Diagnosis, Estimate, LadderStep
from flexgui.sentences.identifiability import identifiability_sentences
from flexgui.sentences.written import format_number
from flexgui.stages.challenge.judging import truth_lines

ROOT = Path(__file__).resolve().parents[3]
FILE = ROOT / "docs" / "teaching" / "answers.md"
SCENARIOS = ROOT / "scenarios" / "teaching"

EI = 1e9 * 0.05**4 / 12.0
"""N m², as built: ε = 1 GPa, d = 5 cm."""
CAMERA = 3e-5 * 2**0.5
"""m rms of the tip: two axes."""
CALIPER = 1e-4
"""m, that the caliper of sheet 2 reads too much."""

HEAD = """# The teacher's answers

Computed from the scenarios of the sheets. Some numbers of sheet 2 depend on the search: another
seed gives another number, and that is the point.
"""


def digest(scenario: str) -> str:
    """Of the scenario that the answers were computed from."""
    return hashlib.sha256((SCENARIOS / f"{scenario}.toml").read_bytes()).hexdigest()[:16]


def text() -> str:
    """The whole file."""
    parts = [HEAD]
    for scenario, (title, seed, level, answers) in SHEETS.items():
        numbered = [f"{k}. {answer}" for k, answer in enumerate(answers(_load(scenario)), 1)]
        parts += [f"## {title}", *numbered, f"Challenge {seed}, {level}:", _truth(seed, level)]
        parts.append(f"<!-- {scenario}: {digest(scenario)} -->")
    return "\n\n".join(part.strip() for part in parts) + "\n"


def _load(scenario: str) -> fg.Project:
    return fg.load(SCENARIOS / f"{scenario}.toml")


def _truth(seed: int, level: str) -> str:
    made = make_challenge(seed, level, Silent())
    return "\n".join(f"- {line}" for line in truth_lines(made.truth))


def _friction(rig: fg.Project) -> Iterator[str]:
    (ei,), first, found = _looked(rig)
    added = found.steps[1]
    fc = {p.name: p for p in added.parameters}
    off = abs(ei.value - EI) / ei.std
    yield (
        f"EI = {_pm(ei)}. It is {off:.1f} standard deviations below {EI:.2f} N m². The number "
        "alone does not show the fault; the residual does."
    )
    yield (
        f"The tip's error is {_um(first)}, {_tip(first) / CAMERA:.0f} times the camera's noise of "
        f"{1e6 * CAMERA:.0f} µm. It jumps where the elbow changes its direction."
    )
    yield (
        "A step at zero velocity; a line through the origin; no function of the velocity (a line "
        "over the acceleration). None of them is a beam: stiffness acts on deflections."
    )
    yield f"Joint 2; the step's half height is f_c = {fc['fc2'].value:.2f} N m."
    yield (
        f"fc2 = {fc['fc2'].value:.3f} N m (true 0.8), fc1 = {fc['fc1'].value:.3f} N m (true 0: it "
        f"ends at its bound). EI becomes {found.values['EI']:.2f} N m², the tip's error "
        f"{_um(added)}, the camera's noise."
    )
    yield (
        f"{_second(found)}. They contain Coulomb friction as a special case and explain as much "
        "with more parameters. So the data do not require them."
    )


def _valley(rig: fg.Project) -> Iterator[str]:
    found = rig.identify().outcome.fits[0]
    value = {e.name: e.value for e in found.estimates}
    (ei,) = found.derived
    eps, d = value["epsilon"] / 1e9, 1e3 * value["d"]
    yield (
        f"With the sheet's seed ε = {eps:.1f} GPa and d = {d:.0f} mm, factors of {eps:.1f} and "
        f"{d / 50.0:.2f}. This is no error of the program: all pairs on the curve fit equally well."
    )
    others = [rig.with_settings(identify={"seed": seed}).identify().values for seed in (2, 3)]
    pairs = [f"({v['epsilon'] / 1e9:.1f} GPa, {1e3 * v['d']:.0f} mm)" for v in others]
    products = [v["epsilon"] * v["d"] ** 4 / 12.0 for v in others]
    assert max(abs(product - ei.value) for product in products) < ei.std
    yield (
        f"With seeds 2 and 3 {' and '.join(pairs)}: ε and d do not repeat. EI = ε d⁴/12 does: "
        f"{_pm(ei)} (built: {EI:.2f} N m²)."
    )
    yield f"A curve. “{identifiability_sentences(found)[0]}”"
    yield (
        "Nowhere else, both: the mass is stated, not computed from d. So the sensitivity to d is "
        "4 ε/d times the sensitivity to ε at every sample. The two columns have one direction: "
        "rank 1."
    )
    yield "1 %: ε d⁴ must stay, and 1.04 × 0.99⁴ = 1.00."
    yield (
        "No and no: both multiply the same direction. Yes, a mass that depends on d distinguishes "
        "them, because the inertia then depends on d alone."
    )
    share = ei.std / ei.value
    yield f"As well as EI, to {100.0 * share:.1f} % (one standard deviation)."
    too_much = 100.0 * (((0.05 + CALIPER) / 0.05) ** 4 - 1.0)
    yield f"d⁴ is {too_much:.1f} % too large, so ε comes out as much too small."
    yield f"EI = {_pm(ei)}; or, with d = 50 mm measured, ε = {ei.value / EI:.3f} GPa ± {share:.3f}."


def _joint(rig: fg.Project) -> Iterator[str]:
    fitted, first, found = _looked(rig)
    before, after = {e.name: e.value for e in fitted}, found.values
    added = found.steps[1]
    yield (
        f"EI1 = {before['EI1']:.0f}, EI2 = {before['EI2']:.0f} N m² of {EI:.0f}. By these "
        f"numbers the second beam would have {100.0 * before['EI2'] / EI:.0f} % of its stiffness."
    )
    yield (
        f"The tip's error is {_um(first)}, {_tip(first) / CAMERA:.0f} times the noise: the soft "
        "beams do not explain the recordings either."
    )
    yield (
        "F l³/(3 EI) and F l²/k. EI' = EI / (1 + 3 EI/(k l)). One static test cannot distinguish "
        "them."
    )
    yield (
        "It sees nothing of the twist, because it sits before the spring, and nothing of the "
        "beam. The camera sees both. So the two differ in motion only: by shape and by the "
        "inertia that vibrates."
    )
    yield (
        "The beam's own deflection stays what it is for a given load; the torque of the first gear "
        "changes with the elbow's angle, because the outer link's lever does."
    )
    best, second = found.ranking[:2]
    yield (
        f"{best.title}: {best.refit_drop_percent:.1f} % of the squared error. Then {second.title} "
        f"with {second.refit_drop_percent:.0f} %: another way to give way between encoder and "
        "camera."
    )
    yield (
        f"c1 = {_size(added, 'c1')}, c2 = {_size(added, 'c2')} (true 0.25 and 0.5 mrad/(N m)); EI1 "
        f"= {after['EI1']:.1f}, EI2 = {after['EI2']:.1f} N m². Both EI were wrong, by "
        f"{EI / before['EI1']:.1f} and {EI / before['EI2']:.1f}; the tip's error falls to "
        f"{_um(added)}."
    )


Answers = Callable[[fg.Project], Iterator[str]]

SHEETS: dict[str, tuple[str, int, str, Answers]] = {
    "friction": ("Sheet 1: see a missing friction", 6, "easy", _friction),
    "valley": ("Sheet 2: why ε and d cannot be distinguished", 32, "easy", _valley),
    "joint_or_link": ("Sheet 3: stiff joint or soft link?", 26, "hard", _joint),
}
"""Scenario -> title, seed and level of the challenge, answers."""


def _looked(rig: fg.Project) -> tuple[tuple[Estimate, ...], LadderStep, Diagnosis]:
    """The first fit, the model's step of the ladder before anything is added, and all else."""
    outcome = rig.diagnose().outcome
    assert outcome.diagnosis is not None
    shared = tuple(e for e in outcome.fits[0].estimates if e.recording is None)
    return shared, outcome.diagnosis.steps[0], outcome.diagnosis


def _pm(e: Estimate) -> str:
    return f"{format_number(e.value, 4)} ± {format_number(e.std, 2)} {e.unit}"


def _tip(step: LadderStep) -> float:
    assert step.tip_rms is not None
    return step.tip_rms


def _um(step: LadderStep) -> str:
    return f"{format_number(1e6 * _tip(step), 2)} µm rms"


def _size(step: LadderStep, name: str) -> str:
    value = next(p.value for p in step.parameters if p.name == name)
    return f"{1e3 * value:.3f} mrad/(N m)"


def _second(found: Diagnosis) -> str:
    near = [r.title for r in found.ranking[1:3]]
    return " and ".join(near)


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
    print(json.dumps({name: digest(name) for name in SHEETS}))
