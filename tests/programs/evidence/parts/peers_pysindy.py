"""PySINDy on the missing torque, beside the law that FlexGUI proposes for the same recordings."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from flexgui.core.propose.propose import propose
from flexgui.core.results import RecordingComparison
from flexgui.core.scenario.read import read_scenario
from flexgui.core.scenario.schema import DiagnoseSpec
from flexgui.core.workbench import run_scenario
from tests.programs.evidence.frame import Summary, better, table
from tests.programs.sample.hidden_drawn import ROLES
from tests.programs.sample.hidden_drawn import cases as hidden
from tests.programs.sample.hidden_laws import Truth, read_truth, written
from tests.programs.sample.law_judge import along, fits

TITLE = "Peers on equal data: PySINDy"
ORDER = 3
FILES: tuple[str, ...] = ()
NEEDS = ("mujoco", "pysindy")
SOURCES = ("mujoco/hidden_laws.py", "sample/hidden_*.py", "sample/law_judge.py")

JUDGED = f"posture{ROLES.index('validate')}"
SIZES, RIDGES = np.geomspace(1e-3, 1.0, 13), (1e-5, 0.05)
"""N m rms that a term must have, and weights of its ridge regression, among which it chooses."""
WAVES = 25
"""per rad: the finest of the places."""
SLIDING = 5e-3
"""rad/s, in which the sign of a rate turns."""
INERTIAL = ("ddtheta1", "ddtheta2")
"""Terms that correct the masses and are no law."""
NAMES = ("theta1", "theta2", "dtheta1", "dtheta2", *INERTIAL, "t")


def library() -> Any:
    """What somebody who knows joints would write down: polynomials of places and rates to the
    third degree, waves over places, dry friction that may depend on place and time, drag."""
    import pysindy as ps

    friction = {
        "sign({1})": lambda q, v, t: np.tanh(v / SLIDING),
        "{0} sign({1})": lambda q, v, t: q * np.tanh(v / SLIDING),
        "{0}^2 sign({1})": lambda q, v, t: q**2 * np.tanh(v / SLIDING),
        "{2} sign({1})": lambda q, v, t: t * np.tanh(v / SLIDING),
        "{1} abs({1})": lambda q, v, t: v * np.abs(v),
    }
    named = [lambda *names, form=form: form.format(*names) for form in friction]
    own = [ps.CustomLibrary(list(friction.values()), named) for _ in range(2)]
    return ps.GeneralizedLibrary(
        [ps.PolynomialLibrary(3), ps.FourierLibrary(n_frequencies=WAVES), *own,
         ps.IdentityLibrary()],
        inputs_per_library=[[0, 1, 2, 3], [0, 1], [0, 2, 6], [1, 3, 6], [4, 5]],
    )  # fmt: skip


def sparse(found: Sequence[RecordingComparison]) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Term -> its coefficient at each joint, and what the law adds (N, 2) along the recording that
    nothing has seen; the threshold has the least error on each other recording in turn."""
    import pysindy as ps

    used = [c for c in found if c.role == "estimate"]
    judged = next(c for c in found if c.recording == JUDGED)
    terms = library().fit(_states(judged))
    # Least squares see of a recording no more than the triangle of its rows, which is far smaller.
    triangles = [np.linalg.qr(np.column_stack([
        terms.transform(_states(c)), *(m.missing for m in c.missing_torque)
    ]), mode="r") for c in used]  # fmt: skip
    X, Y = [t[:, :-2] for t in triangles], [t[:, -2:] for t in triangles]
    samples = len(used[0].channels[0].time)

    def fitted(chosen: Sequence[int], size: float, ridge: float) -> np.ndarray:
        rows, torque = (np.vstack([part[i] for i in chosen]) for part in (X, Y))
        least = size * np.sqrt(samples * len(chosen))
        one = ps.STLSQ(threshold=least, alpha=ridge, normalize_columns=True).fit(rows, torque)
        return np.asarray(one.coef_).T

    def unseen(choice: tuple[float, float]) -> float:
        each = range(len(X))
        return float(sum(
            np.sum((Y[k] - X[k] @ fitted([i for i in each if i != k], *choice)) ** 2) for k in each
        ))  # fmt: skip

    best = fitted(range(len(X)), *min(product(SIZES, RIDGES), key=unseen))
    names = terms.get_feature_names(list(NAMES))
    law = [i for i, name in enumerate(names) if name not in INERTIAL]
    rows = np.asarray(terms.transform(_states(judged)))[:, law]
    size = np.sqrt(np.mean((rows[:, :, None] * best[law]) ** 2, axis=0))
    order = np.argsort(-size.max(axis=1))
    kept = {names[law[i]]: best[law[i]] for i in order if size[i].any()}
    return kept, -rows @ best[law]  # a drive must give what a law takes


def _states(one: RecordingComparison) -> np.ndarray:
    m = one.motion
    assert m is not None
    return np.column_stack([m.position, m.velocity, m.acceleration, one.channels[0].time])


def compared(name: str, _: Path) -> dict[str, Any]:
    """What both say of a case, and how far that is from the truth on the unseen recording."""
    with tempfile.TemporaryDirectory() as place:
        path = written(hidden()[name], Path(place))
        truth, scenario = read_truth(path.parent), read_scenario(path)
        scenario = scenario.model_copy(update={"diagnose": DiagnoseSpec()})
        scenario.model_fields_set.discard("diagnose")
        found = run_scenario(scenario, folder=path.parent).comparisons
        clock = time.process_time()
        terms, added = sparse(found)
        between = time.process_time()
        base, _, options = fits(path.parent, diagnosed=False)
        proposal = propose(base, options)
        spent = between - clock, time.process_time() - between
        laws = proposal.laws[:1]
        proposed = [(law, along(law, np.load(path.parent / "truth.npz"), JUDGED)) for law in laws]
    ours = sum((_at(law.target, curve) for law, curve in proposed), np.zeros(added.shape))
    return {
        "peer": {"terms": len(terms), "first": list(terms)[:2], **_error(truth, added)},
        "ours": {"formula": [law.formula for law in laws], "why": proposal.reason or "",
                 **_error(truth, ours)},
        "seconds": spent,
    }  # fmt: skip


def _at(target: str, curve: np.ndarray) -> np.ndarray:
    """(N, 2) N m of a law at one joint; at a reading instead none."""
    return np.outer(curve, [target == "joint1", target == "joint2"])


def _error(truth: Truth, law: np.ndarray) -> dict[str, float]:
    """rms in N m of what is named along the unseen recording, and of that minus the truth."""
    true = _at(truth.words["target"], truth.along[JUDGED]["law"])
    size, error, hidden = (float(np.sqrt(np.mean(x**2))) for x in (law, law - true, true))
    return {"size": size, "error": error, "true": hidden}


CASES: dict[str, Callable[[Path], dict[str, Any]]] = {
    name: partial(compared, name) for name, case in hidden().items() if case.arm == "rigid"
}

ABOUT = """\
Laws that no catalogue has, in a rigid arm of the independent engine with recorded torques; five \
recordings of 4 s, of which one is seen by no fit. PySINDy gets the torque that the bare model \
lacks along the measured motion, as FlexGUI exports it, and a library that somebody who knows \
joints would write: polynomials of places and rates, waves over places, dry friction that depends \
on place or time, drag, and two accelerations that correct the masses. Its threshold is the one \
that predicts each recording best from the others. FlexGUI proposes a law for the same bare model. \
Error: rms of the law minus the truth along the unseen recording, over the truth's rms; of the arm \
that hides nothing the rms of what is named."""


def summary(found: Mapping[str, Any]) -> Summary:
    """Of the laws: who is nearer, and who invents none."""
    laws = [one for one in found.values() if one["ours"]["true"]]
    if not laws:
        return []
    ours, peer = (float(np.median([o[who]["error"] / o[who]["true"] for o in laws]))
                  for who in ("ours", "peer"))  # fmt: skip
    nearer = sum(o["ours"]["error"] < o["peer"]["error"] for o in laws)
    return [(
        "a law that no catalogue has: error along an unseen motion, median",
        f"{ours:.0%}; nearer in {nearer} of {len(laws)}", f"{peer:.0%}, PySINDy",
        better(ours, peer),
    )]  # fmt: skip


def section(found: Mapping[str, Any]) -> str:
    """Markdown."""
    head = ("hidden", "PySINDy: terms, the largest first", "error", "FlexGUI", "error",
            "processor time: PySINDy, FlexGUI")  # fmt: skip
    return "\n\n".join([ABOUT, table(head, [_row(name, one) for name, one in found.items()])])


def _row(name: str, one: Mapping[str, Any]) -> list[str]:
    peer, ours = one["peer"], one["ours"]
    said = ", ".join(f"`{term}`" for term in peer["first"])
    named = f"{peer['terms']}: {said}" if peer["terms"] else "none"
    law = f"`{ours['formula'][0]}`" if ours["formula"] else f"none: {ours['why']}"
    spent = " s, ".join(f"{s:.0f}" for s in one["seconds"])
    return [name.replace("_rigid", ""), named, _share(peer), law, _share(ours), f"{spent} s"]


def _share(one: Mapping[str, float]) -> str:
    return f"{one['error'] / one['true']:.0%}" if one["true"] else f"{one['size']:.2f} N m"
