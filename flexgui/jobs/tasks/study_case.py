"""One case of a Monte Carlo study."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from core.progress import Progress


def study_case(order: str, *, progress: Progress) -> str:
    """The record of the case that `order` states; both as text."""
    import core.identify.predictor as predictor
    from core.montecarlo.work import answer_text

    threads = predictor.WORKERS
    try:
        return answer_text(order)
    finally:
        # A case takes one thread for itself; the worker's next job may be another kind of work.
        predictor.WORKERS = threads
