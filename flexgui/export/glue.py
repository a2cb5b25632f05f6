"""A number, its unit and what it is the number of stay on one line."""

from __future__ import annotations

import re

_NUMBER = r"\d[\d.,]*\)?(?:~×~10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)?"
_NAME = r"[µmckMG]?(?:rad|deg|Pa|Hz|dB|N|m|g|s|V|A|W|J)[²³⁴]?"
_UNIT = rf"(?:%|°|(?:1~?/~?)?{_NAME}(?:(?:~?/~?|~){_NAME})*)"
_PATTERN = (
    rf"(?:~=~)?[-−]?(?:{_NUMBER}(?:~±~\(?{_NUMBER})?(?:~{_UNIT}(?![\w²³⁴])|~×(?!\S))"
    rf"|{_NUMBER}~±~{_NUMBER})"
)
_QUANTITY = re.compile(_PATTERN.replace("~", "[ \u00a0]"))
"""~ stands for a space of either kind: some of them are glued already."""
NO_BREAK = "\u00a0"


def glued(text: str) -> str:
    """The text, or Markup, with spaces inside its quantities that no line breaks at."""
    return type(text)(_QUANTITY.sub(lambda found: found[0].replace(" ", NO_BREAK), text))
