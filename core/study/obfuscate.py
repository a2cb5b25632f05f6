"""Text that is obfuscated against peeking.

It cannot be read by opening the file, and a changed one is noticed. That is all: the phrase stands
in this file, so whoever reads the program can read every such text. It is no cryptography and
protects nothing but the fun.
"""

from __future__ import annotations

import base64
import hashlib
import hmac
import textwrap

from core.errors import InputError

HEAD = "FlexGUI challenge, sealed. `flexgui reveal` opens it."

_PHRASE = b"no peeking before you have named the effect"
_SALT, _CODE, _WIDTH = 16, 32, 76
"""Bytes of salt and of the code that shows a change; characters in a line."""

_BLOCK = 2048
"""Bytes: shorter texts are filled up with blanks, or their length would tell how much is hidden."""


def obfuscate(text: str, salt: str, head: str = HEAD) -> str:
    """The text obfuscated below a line `head`; the same text and salt give the same. Blanks at the
    end are lost."""
    own = hashlib.sha256(_PHRASE + salt.encode()).digest()[:_SALT]
    plain = text.encode()
    body = _mixed(plain.ljust(-(-len(plain) // _BLOCK) * _BLOCK), own)
    whole = base64.b64encode(own + _code(own, body) + body).decode()
    return "\n".join([head, *textwrap.wrap(whole, _WIDTH), ""])


def opened(sealed: str, source: str, head: str = HEAD) -> str:
    """What was obfuscated; InputError where it was changed. `source` names the file."""
    broken = InputError(f"{source}: the seal is broken, so what is in it cannot be trusted.")
    first, _, rest = sealed.replace("\r\n", "\n").partition("\n")
    if first.strip() != head:
        raise broken
    letters = "".join(rest.split())
    try:
        whole = base64.b64decode(letters, validate=True)
    except ValueError:
        raise broken from None
    if base64.b64encode(whole).decode() != letters:
        raise broken  # the last letter has bits that decoding passes over
    own, code, body = whole[:_SALT], whole[_SALT : _SALT + _CODE], whole[_SALT + _CODE :]
    if not hmac.compare_digest(code, _code(own, body)):
        raise broken
    return _mixed(body, own).decode().rstrip()


def _mixed(text: bytes, salt: bytes) -> bytes:
    """The bytes combined with a stream that phrase and salt decide; twice gives them back."""
    stream = b""
    while len(stream) < len(text):
        count = (len(stream) // 32).to_bytes(8, "big")
        stream += hashlib.sha256(_PHRASE + salt + count).digest()
    return bytes(a ^ b for a, b in zip(text, stream, strict=False))


def _code(salt: bytes, body: bytes) -> bytes:
    key = hashlib.sha256(salt + _PHRASE).digest()
    return hmac.new(key, salt + body, hashlib.sha256).digest()
