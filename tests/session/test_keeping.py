"""What was done is there again after the server has died."""

from __future__ import annotations

import dataclasses
import os
import shutil
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from zlib import crc32

import msgspec
import numpy as np
import pytest

from flexgui.core.errors import InputError
from flexgui.core.files import replacing
from flexgui.core.scenario.read import read_scenario
from flexgui.core.scenario.schema import Scenario
from flexgui.export.serialization import SCHEMA_VERSION, Envelope, deserialize, serialize
from flexgui.library.shipped import demo_scenario, hidden_scenario, shipped_folder
from flexgui.places import OWNER, REPLACED_SUFFIX, RESULTS, WORK, earlier_folder, has_saved_work
from flexgui.server import work_folders
from flexgui.server.services import Services
from flexgui.server.work_folders import SavedWorkFolders
from flexgui.session import saved_work
from flexgui.session.saved_work import SavedResults, SavedWork
from flexgui.session.scenario_edits import apply_edits, set_value
from flexgui.session.session import Session
from flexgui.session.state import STAGES, Topic
from flexgui.stages.challenge.judging import Size
from flexgui.stages.challenge.state import Challenge, Guess
from flexgui.stages.diagnose.effects import with_effect
from flexgui.stages.diagnose.model_versions import ModelVersion
from flexgui.stages.study.state import DONE, STOPPED
from tests.montecarlo.helpers import short
from tests.session.conftest import SOON
from tests.session.helpers import HIDDEN_FRICTION, alone, bring, good_csv, small, until

KEY = "k" * 32


def same(a: Any, b: Any) -> bool:
    """Of records that hold arrays, with NaN equal to NaN."""
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
    if isinstance(a, Scenario):
        return bool(a == b)
    if dataclasses.is_dataclass(a):
        names = [f.name for f in dataclasses.fields(a)]
        return type(a) is type(b) and all(same(getattr(a, n), getattr(b, n)) for n in names)
    if isinstance(a, Mapping):
        return list(a) == list(b) and all(same(a[k], b[k]) for k in a)
    if isinstance(a, tuple | list):
        pairs = zip(a, b, strict=True)
        return type(a) is type(b) and len(a) == len(b) and all(same(x, y) for x, y in pairs)
    return bool(a == b or a != a and b != b)


def begun(work: SavedWorkFolders, key: str = KEY) -> Session:
    made = alone(key, work.begin(key))
    made.store.begin()
    return made


def dead(session: Session) -> None:
    """As after a SIGKILL: nothing is ended or removed; no process has the folder any more."""
    session.closed = True  # nothing more is written
    session.run.stop()
    session.document.close()
    session.playback.close()
    (session.folder / OWNER).write_text("999999999")


@pytest.fixture
def work(tmp_path: Path) -> SavedWorkFolders:
    return SavedWorkFolders(tmp_path / "sessions")


@pytest.fixture
def session(work: SavedWorkFolders) -> Iterator[Session]:
    made = begun(work)
    yield made
    made.close()


def revived(work: SavedWorkFolders) -> Session:
    again = SavedWorkFolders(work.root)
    assert again.knows(KEY)
    made = begun(again)
    assert made.store.earlier is not None and made.store.restore(), made.message
    assert made.store.earlier is None and not earlier_folder(made.folder).exists()
    return made


@pytest.fixture(scope="module")
def found(services: Services, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Session]:
    """An identification and a diagnosis, short."""
    folder = tmp_path_factory.mktemp("found")
    made = Session("found", folder, services)
    made.choose("something hidden")
    small(made)
    assert made.document.change(
        set_value(("diagnose", "candidates"), ["coulomb_friction", "tip_payload"])
    )
    assert made.identification.start()
    until(lambda: not made.run.state.busy)
    assert made.diagnosis.search()
    until(lambda: not made.run.state.busy and made.diagnosis.pending is None)
    assert made.identification.outcome is not None and made.diagnosis.versions
    yield made
    made.close()


def test_results_are_the_same_after_writing_and_reading(found: Session) -> None:
    fitted = found.identification
    stated = SavedResults(fitted.outcome, fitted.outcome_of, found.diagnosis.versions)
    again = deserialize(serialize(stated), SavedResults)
    for name in stated.__struct_fields__:
        assert same(getattr(stated, name), getattr(again, name)), name


@pytest.mark.parametrize("path", sorted(shipped_folder().glob("*.toml")), ids=lambda p: p.stem)
def test_every_scenario_is_the_same_after_writing_and_reading(path: Path) -> None:
    for scenario in (read_scenario(path), demo_scenario(), hidden_scenario()):
        assert deserialize(serialize(scenario), Scenario) == scenario


def test_what_is_no_record_is_neither_written_nor_read() -> None:
    with pytest.raises(TypeError):
        serialize({"a": Path("x")})
    with pytest.raises(ValueError):
        serialize(np.array([object()]))
    with pytest.raises(InputError, match="parts of it are missing"):
        deserialize(serialize({"a": 1}), SavedWork)


GUESSED = (Guess("rotor_inertia", Size("Jh1", 2.0, "kg m²")),)


def test_edits_files_and_a_challenge_are_there_again(
    session: Session, work: SavedWorkFolders, services: Services
) -> None:
    assert session.document.change(set_value(("identify", "population"), 17))
    assert bring(session, "own.csv", good_csv(session))
    session.challenge.state = Challenge(7, "hard", HIDDEN_FRICTION, GUESSED)
    session.comparison.pick("theta1/model")
    session.comparison.show_view("signals of my choice")
    session.notify(Topic.CHALLENGE)
    scenario, content = session.document.scenario, (session.folder / "own.csv").read_bytes()
    dead(session)
    made = revived(work)
    assert made.document.scenario == scenario and made.document.scenario.identify.population == 17
    assert (made.folder / "own.csv").read_bytes() == content
    assert made.wait_idle() and made.playback.recording is not None
    known = made.challenge.state
    assert known is not None and known.guesses == GUESSED
    assert made.comparison.picked == ("theta1/model",)
    assert made.comparison.view == "signals of my choice"
    made.close()


def test_results_are_there_again(session: Session, work: SavedWorkFolders, found: Session) -> None:
    session.document.scenario = found.document.scenario
    session.identification.outcome = found.identification.outcome
    session.identification.outcome_of = found.identification.outcome_of
    session.diagnosis.versions = found.diagnosis.versions
    session.diagnosis.models.all = found.diagnosis.models.all
    session.notify(Topic.OUTCOME)
    dead(session)
    made = revived(work)
    (model,) = made.diagnosis.models.comparable
    assert model is made.diagnosis.models.present and model.title == "As given"
    assert same(made.identification.outcome, found.identification.outcome)
    assert made.identification.outcome_of == made.document.scenario
    assert same(made.diagnosis.versions, found.diagnosis.versions)
    assert made.diagnosis.search(), "it goes on from there"
    made.close()


def test_results_of_other_settings_and_replaced_work_are_there_again(
    session: Session, work: SavedWorkFolders, found: Session
) -> None:
    session.document.scenario = found.document.scenario
    fitted = found.identification
    session.identification.take(fitted.outcome, fitted.outcome_of)
    session.diagnosis.versions = found.diagnosis.versions
    session.diagnosis.models.all = found.diagnosis.models.all
    assert session.document.change(set_value(("identify", "seed"), 5))
    left = session.document.scenario
    assert session.choose("demo")
    dead(session)
    made = revived(work)
    assert made.identification.outcome is None and not made.diagnosis.versions
    assert made.replaced.back() and made.document.scenario == left
    assert made.identification.current is None
    assert made.document.change(set_value(("identify", "seed"), 1))
    assert same(made.identification.current, fitted.outcome)
    assert same(made.diagnosis.versions, found.diagnosis.versions)
    assert made.comparison.shown is made.diagnosis.versions[-1].comparisons
    made.close()


@pytest.mark.long
@pytest.mark.parametrize("end", [dead, Session.close])
def test_a_study_is_there_again_and_goes_on(
    session: Session, work: SavedWorkFolders, end: Callable[[Session], None]
) -> None:
    assert session.open(short().scenario)
    session.study.choose(runs=3, at_once=1)
    assert session.study.start()
    until(lambda: session.study.state.done >= 2, 3.0 * SOON)
    threads = [t for t in threading.enumerate() if t.name == "study"]
    if end is dead:
        session.study.stop()
    end(session)
    for thread in threads:
        thread.join()
    work.end(session.folder)
    made = revived(work)
    until(lambda: bool(made.study.state.sections))
    assert made.study.choice == session.study.choice
    assert (made.study.state.phase, made.study.state.total) == (STOPPED, 6)
    known = made.study.state.done
    assert known >= 2 and "restored" in made.message.text
    assert made.study.start()
    until(lambda: not made.study.state.busy)
    assert (made.study.state.phase, made.study.state.before) == (DONE, known)
    made.close()


def test_a_verdict_is_kept_while_the_last_fit_goes_on(
    session: Session, work: SavedWorkFolders, found: Session
) -> None:
    session.document.scenario, session.diagnosis.pending = (
        found.document.scenario,
        found.diagnosis.versions[-1],
    )
    session.notify(Topic.DIAGNOSIS)
    written = (session.folder / RESULTS).stat().st_mtime_ns
    session.notify(Topic.DIAGNOSIS)
    assert (session.folder / RESULTS).stat().st_mtime_ns == written, "once"
    dead(session)
    made = revived(work)
    assert same(made.diagnosis.versions, (found.diagnosis.versions[-1],))
    assert made.diagnosis.pending is None
    made.close()


@pytest.mark.parametrize("fitted", [True, False])
def test_an_effect_that_was_added_when_the_program_ended_is_there_again_if_it_was_fitted(
    session: Session, work: SavedWorkFolders, found: Session, fitted: bool
) -> None:
    """Its fit was on the screen, its ranking was still computed; or nothing was shown of it."""
    given = found.diagnosis.versions[-1]
    assert given.found is not None and given.comparisons
    grown = apply_edits(found.document.scenario, with_effect("coulomb_friction", None))
    added = ModelVersion(grown, "Coulomb", "coulomb_friction")
    if fitted:
        added = replace(added, found=replace(given.found, ranking=(), diagnosis=None))
        added = replace(added, outcome=given.outcome, comparisons=given.comparisons)
    session.document.scenario, session.diagnosis.versions = grown, (given,)
    session.diagnosis.pending = added
    session.notify(Topic.DIAGNOSIS)
    dead(session)
    made = revived(work)
    kept = [None, "coulomb_friction"] if fitted else [None]
    assert [v.added for v in made.diagnosis.versions] == kept
    assert made.document.scenario == made.diagnosis.versions[-1].scenario
    made.close()


def test_what_was_shown_was_written_before(session: Session, work: SavedWorkFolders) -> None:
    """Whoever hears of a change could be the last to do so."""
    copies: list[tuple[Any, Path]] = []

    def hear(topic: Any) -> None:
        if topic.value == "scenario":
            place = work.root.parent / f"copy-{len(copies)}"
            shutil.copytree(session.folder, place)
            copies.append((session.document.scenario, place))

    session.subscribe(hear)
    for k in range(5):
        assert session.document.change(set_value(("identify", "population"), 20 + k))
    for scenario, place in copies:
        assert deserialize((place / WORK).read_bytes(), SavedWork).scenario == scenario
    assert len(copies) == 5


def test_nothing_is_kept_of_a_session_in_which_nothing_was_done(work: SavedWorkFolders) -> None:
    made = begun(work)
    assert made.wait_idle()
    made.show("Data")
    made.playback.refresh()
    assert made.wait_idle() and not has_saved_work(made.folder)
    made.close()
    work.end(made.folder)
    assert not list(work.root.iterdir())


def test_who_declines_is_asked_again_and_who_begins_anew_keeps_both(work: SavedWorkFolders) -> None:
    first = begun(work)
    assert first.document.change(set_value(("identify", "population"), 17))
    dead(first)
    second = begun(SavedWorkFolders(work.root))
    second.store.decline()
    assert second.store.earlier is None and has_saved_work(earlier_folder(second.folder))
    second.close()
    work.end(second.folder)
    third = begun(SavedWorkFolders(work.root))
    assert third.store.earlier is not None
    third.store.decline()
    assert third.document.change(set_value(("identify", "population"), 19))
    dead(third)
    fourth = begun(work)
    assert fourth.document.change(set_value(("identify", "population"), 21))
    assert fourth.store.restore() and fourth.document.scenario.identify.population == 19
    fourth.close()
    for why, population in (("declined", 17), ("replaced", 21)):
        (aside,) = work.root.glob(f"{why}-*")
        kept = deserialize((aside / WORK).read_bytes(), SavedWork).scenario
        assert kept.identify.population == population


def test_work_that_cannot_be_moved_stays_and_so_does_what_is_here(
    session: Session, work: SavedWorkFolders, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert session.document.change(set_value(("identify", "population"), 17))
    dead(session)
    made = begun(SavedWorkFolders(work.root))
    (made.folder / "own.csv").write_text("mine")
    here, rename = made.document.scenario, Path.rename

    def refuse(path: Path, target: Path) -> Path:
        if path == earlier_folder(made.folder):
            raise OSError(39, "Directory not empty")
        return rename(path, target)

    monkeypatch.setattr(Path, "rename", refuse)
    assert not made.store.restore() and made.store.earlier is not None
    assert made.message.bad and "Directory not empty" in made.message.text
    assert made.document.scenario == here and (made.folder / "own.csv").read_text() == "mine"
    monkeypatch.undo()
    assert made.store.restore() and made.document.scenario.identify.population == 17
    made.close()


Spoil = Callable[[Path], object]


def rewritten(
    path: Path, change: Callable[[dict[str, Any]], object], schema: int = SCHEMA_VERSION
) -> None:
    """The same file with other entries, as another version may write it."""
    envelope = msgspec.msgpack.decode(path.read_bytes()[8:], type=Envelope)
    body = msgspec.msgpack.decode(envelope.body)
    change(body)
    other = Envelope(schema, envelope.arrays, msgspec.msgpack.encode(body))
    written = msgspec.msgpack.encode(other)
    path.write_bytes(b"%08x" % crc32(written) + written)


def without(*names: str) -> Spoil:
    return lambda path: rewritten(path, lambda body: [body.pop(name) for name in names])


def with_more(**more: Any) -> Spoil:
    return lambda path: rewritten(path, lambda body: body.update(more))


OTHER_VERSIONS: dict[str, Spoil] = {
    "older": without("tour", "own", "live"),
    "newer": with_more(more=1, stage="Ponder", live={"colour": "red"}),
    "an older record": lambda path: rewritten(path, lambda b: b["challenge"].pop("changed")),
    "a newer record": lambda path: rewritten(path, lambda b: b["challenge"].update(colour="red")),
}


@pytest.mark.parametrize("version", OTHER_VERSIONS)
def test_work_of_another_version_is_taken_up(
    session: Session, work: SavedWorkFolders, version: str
) -> None:
    assert session.document.change(set_value(("identify", "population"), 17))
    session.challenge.state = Challenge(7, "hard", HIDDEN_FRICTION, GUESSED)
    session.notify(Topic.CHALLENGE)
    OTHER_VERSIONS[version](session.folder / WORK)
    dead(session)
    made = revived(work)
    assert made.document.scenario.identify.population == 17 and made.challenge.state is not None
    assert made.stage in STAGES
    made.close()


UNREADABLE: dict[str, tuple[Spoil, str]] = {
    "damaged": (lambda path: path.write_bytes(b"no zip"), "damaged"),
    "later": (
        lambda path: rewritten(path, lambda body: None, SCHEMA_VERSION + 1),
        "another version",
    ),
    "without a scenario": (without("scenario"), "parts of it"),
    "with an unknown setting": (
        lambda path: rewritten(
            path, lambda b: b.update(scenario=b["scenario"].replace("population", "colour"))
        ),
        "colour",
    ),
}


@pytest.mark.parametrize("fault", UNREADABLE)
def test_work_that_cannot_be_read_is_set_aside_and_never_written_over(
    session: Session, work: SavedWorkFolders, fault: str
) -> None:
    assert session.document.change(set_value(("identify", "population"), 17))
    (session.folder / "own.csv").write_text("mine")
    spoil, said = UNREADABLE[fault]
    spoil(session.folder / WORK)
    stored = (session.folder / WORK).read_bytes()
    dead(session)
    made = begun(SavedWorkFolders(work.root))
    assert not made.store.restore() and made.store.earlier is None
    assert made.document.change(set_value(("identify", "population"), 18))
    assert has_saved_work(made.folder)
    made.close()
    (aside,) = work.root.glob("unread-*")
    assert aside.name in made.message.text and said in made.message.text
    SavedWorkFolders(work.root)
    assert (aside / WORK).read_bytes() == stored and (aside / "own.csv").read_text() == "mine"


def test_results_that_cannot_be_read_are_set_aside_and_the_work_goes_on(
    session: Session, work: SavedWorkFolders
) -> None:
    assert session.document.change(set_value(("identify", "population"), 17))
    (session.folder / RESULTS).write_bytes(b"no zip")
    dead(session)
    made = revived(work)
    (aside,) = made.folder.glob("unread-*")
    assert aside.name in made.message.text and aside.read_bytes() == b"no zip"
    assert made.document.scenario.identify.population == 17 and made.identification.outcome is None
    made.close()


@pytest.mark.parametrize(
    "act",
    [
        lambda session: session.document.change(set_value(("title",), "Another one")),
        lambda session: session.diagnosis.add("coulomb_friction"),
    ],
    ids=["edit", "add"],
)
def test_a_slow_disk_holds_up_nobody_who_moves_something_else(
    session: Session, act: Callable[[Session], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked, free = threading.Event(), threading.Event()

    @contextmanager
    def slow(path: Path) -> Iterator[Path]:
        asked.set()
        free.wait()
        with replacing(path) as temporary:
            yield temporary

    monkeypatch.setattr(saved_work, "replacing", slow)
    with ThreadPoolExecutor() as threads:
        try:
            note_activity = threads.submit(act, session)
            assert asked.wait(SOON)
            threads.submit(session.playback.move, time=0.5).result(SOON)
        finally:
            free.set()
        assert note_activity.result(SOON) and session.playback.cursor.time == 0.5
    session.run.stop()
    assert has_saved_work(session.folder)


def test_a_full_disk_is_told_once(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("flexgui.session.saved_work._write_file", full)
    assert session.document.change(set_value(("identify", "population"), 17))
    assert "Autosave failed" in session.message.text
    session.show_message("")
    assert session.document.change(set_value(("identify", "population"), 18))
    assert not session.message.text


def test_the_oldest_go_first_and_none_that_is_in_use(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = tmp_path / "sessions"
    root.mkdir()
    for k in range(6):
        folder = root / f"{k}"
        folder.mkdir()
        (folder / WORK).write_bytes(bytes(100))
        os.utime(folder / WORK, (1e9 + k, 1e9 + k))
    (root / "0" / OWNER).write_text(str(os.getpid()))
    (root / "none").mkdir()
    monkeypatch.setattr(work_folders, "MOST_BYTES", 250)
    monkeypatch.setattr(work_folders, "LONGEST_AGE", float("inf"))
    SavedWorkFolders(root)
    assert {p.name for p in root.iterdir()} == {"0", "4", "5"}
    monkeypatch.setattr(work_folders, "LONGEST_AGE", 1.0)
    SavedWorkFolders(root)
    assert {p.name for p in root.iterdir()} == {"0"}


def test_what_was_half_written_or_replaced_goes_when_the_server_starts(
    work: SavedWorkFolders,
) -> None:
    session = begun(work)
    assert session.document.change(set_value(("title",), "Mine"))
    (session.folder / "th1.csv").write_text("t")
    (session.folder / ".0123.th2.csv").write_text("t,theta1")
    (session.folder / ".big.zip.unpacking").mkdir()
    (session.folder / ".big.zip.unpacking" / "th3.csv").write_text("t,the")
    dead(session)
    replaced = session.folder.with_name(f"{session.folder.name}{REPLACED_SUFFIX}")
    shutil.copytree(session.folder, replaced)
    SavedWorkFolders(work.root)
    assert {p.name for p in session.folder.iterdir()} == {WORK, OWNER, "th1.csv"}
    assert not replaced.exists()


def test_a_number_that_another_process_has_by_now_is_no_owner(
    session: Session, work: SavedWorkFolders
) -> None:
    assert session.document.change(set_value(("identify", "population"), 17))
    assert not SavedWorkFolders(work.root).knows(KEY), "this process has it"
    assert has_saved_work(session.folder)
    assert work.root.stat().st_mode & 0o777 == 0o700 == session.folder.stat().st_mode & 0o777
    assert KEY not in str(session.folder)
    (session.folder / OWNER).write_text(f"{os.getpid()} 1")
    assert SavedWorkFolders(work.root).knows(KEY), "a process of that number, but a younger one"
