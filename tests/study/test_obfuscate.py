"""The seal keeps from peeking, opens to what was sealed, and breaks when touched."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexgui.core.errors import InputError
from flexgui.core.study.challenge import HEAD, obfuscate, reveal

TEXT = '{"effects": ["coulomb_friction"], "values": {"fc1": 0.2}}'


@given(st.text(max_size=5000).map(str.rstrip), st.text(max_size=20))
def test_what_is_sealed_comes_out(text: str, salt: str) -> None:
    assert reveal(obfuscate(text, salt), "x") == text


def test_the_same_text_gives_the_same_seal_and_another_salt_another() -> None:
    assert obfuscate(TEXT, "1") == obfuscate(TEXT, "1")
    body = {salt: obfuscate(TEXT, salt).splitlines()[1:] for salt in "12"}
    assert not set(body["1"]) & set(body["2"])


def test_nothing_can_be_read_and_the_length_tells_nothing() -> None:
    sealed = obfuscate(TEXT, "1")
    assert "coulomb" not in sealed
    assert len(obfuscate("nothing", "1")) == len(sealed)


@pytest.mark.parametrize("place", [0, 10, 300, -3])
def test_a_changed_character_breaks_the_seal(place: int) -> None:
    head, _, body = obfuscate(TEXT, "1").partition("\n")
    at = place % len(body)
    other = "A" if body[at] != "A" else "B"
    with pytest.raises(InputError, match="truth.sealed: the file was changed"):
        reveal(f"{head}\n{body[:at]}{other}{body[at + 1 :]}", "truth.sealed")


@pytest.mark.parametrize(
    "text", ["", HEAD, HEAD + "\n", HEAD + "\nAAAA\n", HEAD + "\n%%%\n", "{}", HEAD + "\nä\n"]
)
def test_what_is_no_seal_is_called_broken(text: str) -> None:
    with pytest.raises(InputError, match="broken"):
        reveal(text, "x")


def test_other_line_ends_do_no_harm() -> None:
    assert reveal(obfuscate(TEXT, "1").replace("\n", "\r\n"), "x") == TEXT
