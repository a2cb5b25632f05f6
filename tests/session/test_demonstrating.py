"""What an effect does to the arm, without a page."""

from __future__ import annotations

import numpy as np

from flexgui.session import Session
from flexgui.session.edit import Document
from flexgui.views.demonstration import demonstration, told
from tests.session.conftest import Offered
from tests.session.helpers import until


def short(session: Session) -> None:
    def edit(document: Document) -> None:
        document["recordings"] = document["recordings"][:1]
        document["recordings"][0]["simulate"]["seconds"] = 1.0

    session.choose("something hidden", None)  # type: ignore[arg-type]  (it reads no file)
    assert session.change(edit)


def test_an_effect_is_shown_where_it_changes_most(session: Session, services: Offered) -> None:
    short(session)
    assert session.demonstrate("coulomb_friction", services)
    until(lambda: session.demonstration is not None or bool(session.not_shown))
    shown = session.demonstration
    assert shown is not None, session.not_shown
    assert shown.kind == session.demonstrated == "coulomb_friction"
    assert {p.name for p in shown.sizes} == {"fc1", "fc2"} and "fc" in told(shown)
    assert np.abs(shown.with_it - shown.without).max() > 0.0
    assert len(shown.time) == len(shown.measured) < 1000
    names = [t["name"] for t in demonstration(shown)["data"]]
    assert names[:3] == ["measured", "without it", "with it"]
    assert not session.busy, "the session's own job is another one"
    session.end_demonstration()
    assert session.demonstration is None


def test_every_listed_effect_is_shown_or_says_why_not(session: Session, services: Offered) -> None:
    short(session)
    for kind in ("torque_ripple", "extra_bending_mode", "gravity_tilt", "sensor_lag", "nobody"):
        session.demonstrate(kind, services)
        until(lambda: session.demonstration is not None or bool(session.not_shown))
        assert session.demonstration is not None or session.not_shown.endswith((".", "?")), kind


def test_another_model_ends_it(session: Session, services: Offered) -> None:
    short(session)
    session.demonstrate("viscous_friction", services)
    until(lambda: session.demonstration is not None)
    session.change(lambda document: document["recordings"][0].update(role="validate"))
    assert session.demonstration is None and not session.demonstrated
