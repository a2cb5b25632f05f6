"""Model against measurements: ladder, maps and signals of one fit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flexgui.core.results import ErrorMaps, RecordingComparison
from flexgui.core.scenario.schema import Scenario
from flexgui.session.state import Topic
from flexgui.stages.diagnose.model_versions import ladder_steps
from flexgui.views.error_map import ErrorNow, error_now
from flexgui.views.of_recording.view import believable_floors

if TYPE_CHECKING:
    from flexgui.session.session import Session


SIGNALS = "signals"
"""The view with which a person begins."""
LADDER_STAGE = "Diagnose"
MOST_PICKED = 12
"""Signals in one plot: more cannot be distinguished."""


class Comparison:
    """Comparison by the diagnosis or the identification, computed when it is shown."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._failing: WhereItFails | None = None
        self.picked: tuple[str, ...] = ()
        """Keys of the signals in the person's own plot."""
        self.view = SIGNALS
        """Title of the view that is shown."""
        self._scale: tuple[object, float] = (None, 1.0)

    def pick(self, key: str) -> None:
        """Puts a signal into the person's own plot, or takes it out."""
        with self._session.changing(Topic.DIAGNOSIS):
            others = tuple(k for k in self.picked if k != key)
            self.picked = others if key in self.picked else (*others[1 - MOST_PICKED :], key)

    def show_view(self, title: str) -> None:
        """Shows another view of the recording; kept with the work."""
        with self._session.changing(Topic.DIAGNOSIS):
            self.view = title

    @property
    def shown(self) -> tuple[RecordingComparison, ...]:
        """Comparisons by the diagnosis fit of the newest version, else by the identification."""
        return self._shown[0]

    @property
    def on_arm(self) -> WhereItFails | None:
        """Where the model fails, as the arm shows it. None where that was computed with other
        settings than those by which the arm moves; on Diagnose, where the ladder was."""
        session = self._session
        newest = session.diagnosis.newest if session.stage == LADDER_STAGE else None
        of = self._shown[1] if newest is None else newest.scenario
        is_present = of == session.document.scenario or session.diagnosis.pending is not None
        return self.failing if is_present else None

    @property
    def _shown(self) -> tuple[tuple[RecordingComparison, ...], Scenario | None]:
        """What is shown, and the scenario that it was computed with."""
        diagnosis, fitted = self._session.diagnosis, self._session.identification
        version, outcome = next(reversed(diagnosis.compared_versions), None), fitted.outcome
        by_fit = () if outcome is None else outcome.comparisons
        if version is None or not version.comparisons:
            return by_fit, fitted.outcome_of
        of = fitted.outcome_of or self._session.document.scenario
        same = version.scenario == of and outcome is version.outcome
        if same or version is diagnosis.pending:
            return version.comparisons, version.scenario
        return by_fit, fitted.outcome_of

    def beside(self, recording: str) -> tuple[str, RecordingComparison] | None:
        """Title and comparison of the model that is drawn beside, for a recording."""
        model = self._session.diagnosis.models.beside
        compared = () if model is None else model.version.comparisons
        found = next((c for c in compared if c.recording == recording), None)
        return None if model is None or found is None else (model.title, found)

    @property
    def floors(self) -> dict[str, float] | None:
        """channel -> noise floor, as in the ladder; None before a diagnosis."""
        steps = ladder_steps(self._session.diagnosis.compared_versions)
        return {e.channel: e.floor for e in steps[-1].errors} if steps else None

    @property
    def failing(self) -> WhereItFails | None:
        """Where the model fails; None if nothing was compared."""
        shown, floors = self.shown, self.floors
        known = self._failing
        if known is None or known.comparisons is not shown or known.stated != floors:
            known = where_it_fails(shown, floors) if shown else None
            self._failing = known
        return known

    @property
    def worst_error(self) -> float:
        """Noise floors of the arm's darkest colour: the worst error of the first model."""
        first = next(iter(self._session.diagnosis.shown_versions), None)
        shown = first.comparisons if first is not None and first.comparisons else self.shown
        if self._scale[0] is not shown:
            failing = self.failing
            if shown is not self.shown or failing is None:
                failing = where_it_fails(shown, self.floors) if shown else None
            traces = () if failing is None else tuple(failing.now.values())
            self._scale = (shown, max([one.worst for one in traces], default=1.0))
        return self._scale[1]


@dataclass(frozen=True)
class Board:
    """The error of all outputs together, by recording and time."""

    recordings: tuple[str, ...]
    edges: np.ndarray
    """(columns + 1,) s since the start"""
    ratio: np.ndarray
    """(recordings, columns) rms over the outputs, in floors"""


@dataclass(frozen=True)
class WhereItFails:
    """Error maps, board and errors over time of some comparisons."""

    comparisons: tuple[RecordingComparison, ...]
    stated: Mapping[str, float] | None
    """Floors that a diagnosis stands on."""
    floors: Mapping[str, float]
    maps: ErrorMaps
    board: Board | None
    now: Mapping[str, ErrorNow]
    """recording -> its error along the time"""


def where_it_fails(
    comparisons: tuple[RecordingComparison, ...], stated: Mapping[str, float] | None
) -> WhereItFails:
    """Computes error maps, board and errors over time."""
    from flexgui.core.error_maps import error_maps

    floors = believable_floors(comparisons) if stated is None else stated
    maps = error_maps(comparisons, floors)
    traces = {c.recording: error_now(c, floors) for c in comparisons}
    drawn = {name: trace for name, trace in traces.items() if trace is not None}
    return WhereItFails(comparisons, stated, floors, maps, _board(maps), drawn)


def _board(maps: ErrorMaps) -> Board | None:
    if not maps.by_time:
        return None
    first = max(maps.by_time, key=lambda m: len(m.recordings))
    layers = []
    for m in maps.by_time:
        layer = np.full(first.rms.shape, np.nan)
        for i, name in enumerate(m.recordings):
            if name in first.recordings and len(m.edges) == len(first.edges):
                layer[first.recordings.index(name)] = m.ratio[i]
        layers.append(layer)
    square = np.ma.masked_invalid(np.array(layers) ** 2)
    ratio = np.sqrt(square.mean(axis=0).filled(np.nan))
    return Board(first.recordings, first.edges, ratio)
