"""Effects whose sizes are pressed to the bound of what is plausible.

Something else is missing that acts as they do, and what is found instead may stand in for it too.
"""

from __future__ import annotations

from core.diagnose.acceptance import Round
from core.diagnose.evidence import RELEVANT, at_bounds
from core.diagnose.minimum import converged
from core.diagnose.revision import priced, without_refuted
from core.diagnose.state import Implausible, State, step_of
from core.progress import Progress
from core.results import DiagnosisRound, Reason


def keep_implausible(state: State, seen: Round, last: DiagnosisRound) -> None:
    """Where the search is to go back to if it finds nothing better than what it refused."""
    for refusal in seen.refusals:
        if refusal.objection.reason is Reason.AT_BOUND:
            before = state.copied()
            before.rounds.append(last)
            state.implausible.append(Implausible(priced(refusal.after, seen.data), before))
            return


def stands_in(state: State) -> bool:
    """Goes back to where an effect was refused at its bound if all that was found after it leaves
    more than that one by itself: it stands in for the same unknown. Whether it was so."""
    price = RELEVANT * state.data.count
    for one in state.implausible:
        if one.cost + price < priced(state.refit, state.data):
            state.returned(one.before)
            return True
    return False


def take_out_refuted(state: State, progress: Progress) -> bool:
    """Takes out the effects whose sizes were pressed to a bound by what came later; whether there
    was one. The search does not come back to them."""
    ended = dict(reversed(at_bounds(state.refit, state.data)))
    gone = [e for e in state.found if e.kind in ended]
    if not gone or progress.stopped():
        return False
    kept = without_refuted(
        state.data, state.refit, state.present, state.given, ended, progress.stopped
    )
    state.data, state.refit = converged(state.data, kept.refit.hypothesis, None, progress.stopped)
    state.present = list(kept.effects)
    state.passed += [e.title for e in gone]
    state.refuted |= {e.kind: (e.title, ended[e.kind]) for e in gone}
    names = ", ".join(e.title for e in gone)
    state.steps.append(step_of(state, None, f"Without: {names}"))
    return True
