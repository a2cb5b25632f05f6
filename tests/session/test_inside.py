"""What a page's session reads lies in its own folder, whatever a scenario names."""

from __future__ import annotations

import io
import stat
import zipfile
from functools import partial
from pathlib import Path

import pytest

from flexgui.core.errors import InputError
from flexgui.core.progress import Silent
from flexgui.core.scenario.data_folder import VARIABLE, ConfinedFolder
from flexgui.places import hide_paths
from flexgui.scene.recorded_motion import load_motion
from flexgui.server.demo import copy_session
from flexgui.session.session import Session
from flexgui.stages.data.inspect import headers, read_file
from flexgui.stages.data.uploads import safe_name, scenario_file, unpack, zipped
from flexgui.stages.identify.task import identify
from tests.session.conftest import UPLOAD_LIMIT
from tests.session.elsewhere import CONTENT, SECRET, lay_traps, names, scenario, secret, stated
from tests.session.helpers import alone


class Trapped:
    """A session whose folder has been tampered with."""

    def __init__(self, session: Session) -> None:
        self.session, self.folder = session, session.folder
        self.secret = secret(self.folder.parent)
        lay_traps(self.folder, self.secret)
        self.names = names(self.folder, self.secret)
        self.said: list[str] = []
        session.subscribe(lambda topic: self.said.append(session.message.text))

    def gives_nothing_away(self, file: str, session: Session) -> None:
        """By no way that ends at a browser."""
        assert session.wait_idle()
        for content in taken(session):
            assert SECRET.encode() not in content, file
        told = " ".join((*self.said, session.message.text))
        assert SECRET not in told and str(self.folder) not in told, file


def taken(session: Session) -> list[bytes]:
    """What Export → Scenario file gives, unpacked."""
    try:
        _, content = scenario_file(session.document.scenario, session.folder)
    except InputError as error:
        return [str(error).encode()]
    if not zipfile.is_zipfile(io.BytesIO(content)):
        return [content]
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        return [archive.read(name) for name in archive.namelist()]


@pytest.fixture
def trapped(session: Session) -> Trapped:
    return Trapped(session)


def test_an_uploaded_scenario_reads_nothing_from_elsewhere(trapped: Trapped) -> None:
    for file in trapped.names:
        trapped.session.recordings.upload("it.toml", stated(file).encode()).result()
        trapped.gives_nothing_away(file, trapped.session)


def test_neither_does_one_that_is_there_already(trapped: Trapped) -> None:
    """As it may stand in a session that was kept from before."""
    for file in trapped.names:
        trapped.session.document.scenario = scenario(file)
        trapped.session.playback.refresh()
        trapped.session.recordings.choose_columns("it").result()
        trapped.gives_nothing_away(file, trapped.session)


def test_the_tasks_of_a_worker_read_nothing_from_elsewhere(
    trapped: Trapped, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, str(trapped.folder.parent))
    for file in (*trapped.names, trapped.secret.name):
        with pytest.raises(InputError) as refused:
            identify(scenario(file), str(trapped.folder), progress=Silent())
        said = str(refused.value)
        assert SECRET not in said and str(trapped.folder) not in said, file


def test_neither_do_those_that_look_into_what_was_brought(
    trapped: Trapped, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, str(trapped.folder.parent))
    room = str(trapped.folder)
    for file in (*trapped.names, trapped.secret.name):
        stated_here, entry = scenario(file), {"file": "it.csv"}
        for ask in (
            partial(headers, room, file),
            partial(read_file, room, file, [entry], stated_here),
            partial(load_motion, stated_here, "it", room, {}),
            partial(unpack, room, file, UPLOAD_LIMIT),
        ):
            with pytest.raises(
                InputError, match="not a plain file name|not among the files"
            ) as refused:
                ask(progress=Silent())
            said = str(refused.value)
            assert SECRET not in said and room not in said, file


@pytest.mark.long
def test_a_followers_copy_takes_nothing_from_elsewhere(trapped: Trapped) -> None:
    """Neither by the scenario's names nor by links in the teacher's folder."""
    for k, file in enumerate(trapped.names):
        folder = trapped.folder.parent / f"own-{k}"
        own = alone(f"own-{k}", folder)
        trapped.session.document.scenario = scenario(file)
        copy_session(trapped.session, own)
        trapped.gives_nothing_away(file, own)
        assert all(SECRET not in path.read_text() for path in folder.rglob("*"))
        own.close()


def test_a_zip_brings_no_file_out_of_the_folder_and_none_in(trapped: Trapped) -> None:
    before = set(trapped.folder.parent.rglob("*"))
    for file in trapped.names:
        if "\0" in file or not file.strip("./ "):
            continue
        room = io.BytesIO()
        with zipfile.ZipFile(room, "w") as archive:
            archive.writestr("it.toml", stated(safe_name(file)))
            archive.writestr(linked(file, trapped.secret), str(trapped.secret))
        trapped.session.recordings.upload("it.zip", room.getvalue()).result()
        trapped.gives_nothing_away(file, trapped.session)
    new = set(trapped.folder.parent.rglob("*")) - before
    assert all(p.parent == trapped.folder and p.is_file() and not p.is_symlink() for p in new)
    assert trapped.secret.read_text() == CONTENT


def linked(name: str, target: Path) -> zipfile.ZipInfo:
    """A member that says it is a symbolic link."""
    member = zipfile.ZipInfo(name)
    member.external_attr = (stat.S_IFLNK | 0o777) << 16
    return member


def test_an_upload_stays_in_the_folder_under_every_name(trapped: Trapped) -> None:
    before = set(trapped.folder.parent.rglob("*"))
    for file in trapped.names:
        trapped.session.recordings.upload(f"{file}.toml", stated("th1.csv").encode()).result()
    new = set(trapped.folder.parent.rglob("*")) - before
    assert new and {path.parent for path in new} == {trapped.folder}
    assert trapped.secret.read_text() == CONTENT


def test_a_plain_name_of_an_uploaded_file_is_found(session: Session) -> None:
    path = session.folder / "Messung 3_ä+b=c-2.csv.gz"
    path.write_text("t\n")
    assert ConfinedFolder(session.folder).find(path.name) == path


def test_a_scenario_with_its_recordings_in_folders_is_refused_in_words(session: Session) -> None:
    before = session.document.scenario
    content = zipped({"it.toml": stated("data/th1.csv").encode(), "data/th1.csv": b"t\n"})
    assert not session.recordings.upload("work.zip", content).result()
    assert "not a plain file name" in session.message.text and session.message.bad
    assert session.document.scenario == before


@pytest.mark.parametrize("quote", ["{}", "'{}'", "in {}; and", "({})", '"{}".'])
def test_a_sentence_tells_the_last_part_of_the_servers_paths_only(
    tmp_path: Path, quote: str
) -> None:
    for path in (tmp_path / "a" / "th1.csv", Path.home() / "x" / "th1.csv"):
        assert hide_paths(quote.format(path), tmp_path) == quote.format("th1.csv")
    assert hide_paths("12 N m s/rad, /s or z1/z2", tmp_path) == "12 N m s/rad, /s or z1/z2"
