"""A file that is nobody's business, and many ways to name it in a scenario."""

from __future__ import annotations

import os
from pathlib import Path

from flexgui.core.scenario.read import parse_scenario
from flexgui.core.scenario.schema import Scenario

SECRET = "a-private-word"
"""In the first line of the file, as its only heading, and in its cells."""
CONTENT = f"t,{SECRET}\n{SECRET},1\n"


def secret(folder: Path) -> Path:
    """A file that reads like a table, beside the session's folder."""
    path = folder / "secret.csv"
    path.write_text(CONTENT)
    return path


def lay_traps(session: Path, target: Path) -> None:
    """Links, a folder and a pipe inside a session's folder: no upload makes such things."""
    (session / "link.csv").symlink_to(target)
    (session / "chain.csv").symlink_to(session / "link.csv")
    (session / "door").symlink_to(target.parent)
    (session / "room").mkdir()
    (session / "room" / "inside.csv").write_text(CONTENT)
    (session / ".hidden.csv").write_text(CONTENT)
    os.mkfifo(session / "pipe.csv")


def names(session: Path, target: Path) -> tuple[str, ...]:
    """What a scenario may try as `file`."""
    up = os.path.relpath(target, session)
    here, name = str(target), target.name
    deep = "../" * 30 + here.lstrip("/")
    return (
        # absolute
        here, f"/{here}", f"//{here}", here.replace("/", "//"), here.replace("/", "/./"),
        f"{target.parent}/../{target.parent.name}/{name}", f"file://{here}", f"{here}/", f" {here}",
        "/etc/passwd", "/etc/hostname", "/home/a/.ssh/id_rsa", "~/.ssh/id_rsa", "~root/notes.txt",
        "$HOME/notes.txt", str(session / "room" / "inside.csv"),
        # dots
        up, f"./{up}", f"room/../{up}", deep, ".", "..", "...", "./", "../", ".hidden.csv",
        "room/inside.csv", "room", "././room/./inside.csv",
        # links
        "link.csv", "chain.csv", "door", f"door/{name}", f"door/../{target.parent.name}/{name}",
        "/proc/self/root" + here, "/proc/self/cwd/pyproject.toml",
        # case
        here.upper(), up.upper(), name.upper(), "LINK.CSV",
        # encodings
        up.replace("/", "%2f"), up.replace(".", "%2e"), up.replace("/", "%252f"),
        up.replace("/", "\\"), up.replace("/", "\uff0f"), up.replace("/", "\u2215"),
        up.replace("/", "\u2044"), up.replace("..", "\uff0e\uff0e"), up.replace("..", "\u2025"),
        up.replace("/", "\\u002f"), f"{up}\x00.csv", "link.csv\x00", f"{up}\n", "link\u200b.csv",
        # devices, pipes and processes
        "/dev/zero", "/dev/stdin", "/dev/fd/0", "/dev/null", "pipe.csv", "/proc/self/environ",
        "/proc/self/maps", "/proc/1/cmdline", "CON", "nul.csv", "COM1.txt",
        # other systems
        "C:\\Windows\\win.ini", "\\\\server\\share\\a.csv", "\\\\?\\C:\\a.csv", "a.csv:stream",
        "link.csv::$DATA", "C:link.csv",
        # members of archives, patterns, lengths
        f"work.zip/{name}", f"work.zip!{name}", f"zip://work.zip!/{name}", f"work.zip#{name}",
        "*", "*.csv", "?ecret.csv", "[s]ecret.csv", "link.csv ", "link.csv.", "a" * 5000,
    )  # fmt: skip


def stated(file: str) -> str:
    """A scenario whose recording is that file."""
    escaped = "".join(c if c.isalnum() else f"\\U{ord(c):08x}" for c in file)
    return (
        'title = "Elsewhere"\n[arm]\npreset = "paper"\n[drive]\ngains = [60.0, 30.0]\n'
        f'[[recordings]]\nname = "it"\nfile = "{escaped}"\n'
    )


def scenario(file: str) -> Scenario:
    return parse_scenario(stated(file), "elsewhere.toml")
