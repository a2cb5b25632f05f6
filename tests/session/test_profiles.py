"""The profile of a parameter, computed in a session."""

from __future__ import annotations

import pytest

from flexgui.session.session import Session
from flexgui.views.profile import interval_sentence
from tests.session.helpers import small, until


@pytest.fixture
def identified(session: Session) -> Session:
    session.choose("paper_glocal")
    small(session)
    assert session.identification.start()
    until(lambda: not session.run.busy)
    assert session.identification.current is not None
    return session


def test_a_profile_is_of_the_last_result_and_goes_with_it(identified: Session) -> None:
    found, name = identified.identification, identified.document.scenario.identify.parameters[0]
    assert found.find_profile(name, None)
    until(lambda: not identified.run.busy)
    assert found.profile is not None
    assert found.profile.estimate.name == name
    assert name in interval_sentence(found.profile)
    found.take(None, None)
    assert found.profile is None


def test_without_a_result_there_is_none(session: Session) -> None:
    assert not session.identification.find_profile("EI1", None)
