"""`report.html`: one file that works without a network."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from flexgui import __version__
from flexgui.core.error_maps import error_maps
from flexgui.core.results import Outcome, RecordingComparison
from flexgui.export.figures import Figures
from flexgui.export.report_motion import Motion
from flexgui.export.report_sections import diagnosis_section, glance
from flexgui.export.template import environment
from flexgui.sentences.identifiability import notes, sentences_of_fits
from flexgui.sentences.written import format_number, quantity, shown_unit, with_unit
from flexgui.views.comparison import comparison
from flexgui.views.convergence import convergence
from flexgui.views.fit_table import (
    ROLES,
    bar_label,
    fit_dots,
    fit_table,
    overview,
    variants,
)
from flexgui.views.headline import (
    comparisons_as_given,
    final_comparisons,
    has_added_effects,
    kept_effects,
    of_same_recording,
)
from flexgui.views.identifiability import correlation, valley
from flexgui.views.layout import MOST_POINTS, Figure, with_height
from flexgui.views.missing_torque import missing_over_time, missing_over_velocity
from flexgui.views.of_recording import recording_views
from flexgui.views.of_recording.view import Seen, believable_floors
from flexgui.views.parameter_tables import (
    between_runs,
    changes,
    final_parameters,
    first_parameters,
    parameter_changes,
)
from flexgui.views.summary import alarms, lead_sentences, which_fit_in_report
from flexgui.views.table import PAPER, Column, Row, Table, affine, mathml_lines, matrices

SIGNALS = 130_000
"""Points of all signals: 3 bytes each keep a report with its scripts (1.6 MB) near 2 MB."""
FEWEST_POINTS = 400
"""Of a line, on an A4 page two to a millimetre; the tables hold every sample."""
PER_CHANNEL = 4
"""Lines: measured, model, and the residuals of the model as given and as it stands."""

OPEN = 3
"""So many recordings are open; the others open with a click, which keeps the page quick."""


def report_html(outcome: Outcome, scenario_text: str, motion: Motion | None = None) -> str:
    """The whole page as text."""
    return (
        environment()
        .get_template("report.html.j2")
        .render(
            figures=Figures(),
            glance=glance(outcome, scenario_text),
            version=__version__,
            scenario_text=scenario_text,
            motion=motion,
            **_content(outcome),
        )
    )


def _content(outcome: Outcome) -> dict[str, Any]:
    shown, before = final_comparisons(outcome), comparisons_as_given(outcome)
    diagnosed, model = diagnosis_section(outcome), outcome.model
    return {
        "title": outcome.title,
        "alarms": alarms(outcome),
        "lead": lead_sentences(outcome),
        "overview": overview(shown, before),
        "which_fit": which_fit_in_report(outcome),
        "diagnosis": diagnosed,
        "parameters": final_parameters(outcome) if outcome.fits else None,
        "changes": _changes(outcome),
        # Once effects are added, the model as given is that of the diagnosis fit alone.
        "parameters_as_given": None if has_added_effects(outcome) else first_parameters(outcome),
        "between_runs": between_runs(outcome.repeated),
        # Of a way on the page the last fit is of the grown model.
        "first_fit": FIRST_FIT if has_added_effects(outcome) and not outcome.as_given else "",
        "sentences": sentences_of_fits(outcome.fits),
        "valley": valley(outcome.fits),
        "fit_table": fit_table(shown, before) if shown else None,
        # Without a ladder they are the figure of the first page.
        "fit_dots": fit_dots(shown) if diagnosed else None,
        "variants": variants(outcome),
        "recordings": _recordings(shown, before),
        "missing": _missing(shown),
        "views": _views(outcome, shown),
        "convergence": convergence(outcome.fits),
        "correlations": [drawn for fit in outcome.fits if (drawn := correlation(fit))],
        "equations": [(e.title, mathml_lines(e.latex, PAPER), e.note) for e in outcome.equations],
        "matrices": matrices(model),
        "statements": (affine("E", model.basis), affine("A", model.A_basis)),
        "arm": _arm(outcome),
        "notes": (*notes(outcome), *_messages(outcome)),
    }


def _changes(outcome: Outcome) -> Table | None:
    found = outcome.diagnosis
    if found is None or not found.added:
        return None
    return parameter_changes(changes(found.steps, found.parameters), kept_effects(found))


FIRST_FIT = "First fit: identification of the model as given."


def _recordings(
    comparisons: tuple[RecordingComparison, ...], before: tuple[RecordingComparison, ...]
) -> list[dict[str, Any]]:
    points = points_per_line(comparisons)
    return [
        {"label": bar_label(recording, comparisons), "open": k < OPEN, "note": recording.note}
        | _drawn(recording, of_same_recording(recording, before), points)
        for k, recording in enumerate(comparisons)
        if recording.channels
    ]


def points_per_line(comparisons: Sequence[RecordingComparison]) -> int:
    """Points per signal: fewer for many recordings, so that the report loads quickly."""
    lines = PER_CHANNEL * sum(len(recording.channels) for recording in comparisons)
    return min(max(SIGNALS // max(lines, 1), FEWEST_POINTS), MOST_POINTS)


def _drawn(
    recording: RecordingComparison, before: RecordingComparison | None, points: int
) -> dict[str, Any]:
    """Figures of one recording, outputs that were not fitted apart, and its tip error."""
    about = [ROLES.get(recording.role, recording.role)]
    if recording.tip_rms is not None:
        about.append(f"tip error {quantity(recording.tip_rms, 'm')} rms")
    if before is not None and before.tip_rms is not None:
        about.append(f"model as given {quantity(before.tip_rms, 'm')}")
    block: dict[str, Any] = {"about": ", ".join(about)}
    for name, fitted in (("fitted", True), ("others", False)):
        chosen = [c for c in recording.channels if c.fitted is fitted]
        block[name] = comparison(recording, chosen, before, points) if chosen else None
    return block


def _views(
    outcome: Outcome, comparisons: tuple[RecordingComparison, ...]
) -> list[tuple[str, str, Figure]]:
    """(title, about, figure) of the views that are meant for reports."""
    chosen = [view for view in recording_views().values() if view.in_report]
    if not chosen or not comparisons:
        return []
    stated = outcome.diagnosis.floors if outcome.diagnosis is not None else {}
    maps = error_maps(comparisons, stated or believable_floors(comparisons))
    seen = Seen(comparisons[0], comparisons, maps)
    drawn = [(v.title, v.about, v.draw(seen)) for v in chosen]
    return [(title, about, with_height(d)) for title, about, d in drawn if d is not None]


def _missing(
    comparisons: tuple[RecordingComparison, ...],
) -> list[tuple[str, bool, Figure | None, Figure | None]]:
    shown = [(bar_label(r, comparisons), r.missing_torque) for r in comparisons if r.missing_torque]
    points = points_per_line(comparisons)
    return [
        (
            label, k == 0, missing_over_time(torques, points),
            missing_over_velocity(torques, points),
        )
        for k, (label, torques) in enumerate(shown)
    ]  # fmt: skip


def _arm(outcome: Outcome) -> Table | None:
    if not outcome.arm_table:
        return None
    rows = []
    for name, title, value, unit in outcome.arm_table:
        shown = shown_unit(value, unit)
        number = with_unit(format_number(value * shown.factor), shown.name)
        rows.append(Row((title or name, name, number)))
    return Table((Column("What"), Column("Name"), Column("Value", numeric=True)), tuple(rows))


def _messages(outcome: Outcome) -> list[str]:
    messages = [f"{fit.label}: {fit.message}" for fit in outcome.fits if fit.message]
    spent = ", ".join(f"{what} {format_number(s, 3)} s" for what, s in outcome.seconds.items())
    return messages + ([f"Time spent: {spent}."] if spent else [])
