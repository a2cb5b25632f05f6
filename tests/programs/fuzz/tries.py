"""`python -m tests.programs.fuzz.tries`: what was once found open or fragile, tried again; a table.

Each row names a way in, or a way to lose work, and the tests that try it: nothing here is tried by
another code than in the suite. Rows of minutes (kills, stopped workers, memory) are left out by
`--quick`; `--items 1 3` tries those of these items only.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.effects.hostile import HOSTILE
from tests.server.test_guard import BAD, FRAMES
from tests.server.test_guessing import GUESSES
from tests.session.elsewhere import names

ROOT = Path(__file__).resolve().parents[3]


@dataclass(frozen=True)
class Row:
    """One way that is tried."""

    item: str
    what: str
    tests: tuple[str, ...]
    """File, or file::test; all cases of it."""
    each: Callable[[], int] = lambda: 1
    """Tries within one case."""
    long: bool = False


def paths() -> int:
    """Names of files that are none of a session's business."""
    return len(names(Path("/a/session"), Path("/a/secret.csv")))


ROWS = (
    Row("1", "read a foreign file: upload, load, task, copy, export", (
        "tests/session/test_inside.py::test_an_uploaded_scenario_reads_nothing_from_elsewhere",
        "tests/session/test_inside.py::test_neither_does_one_that_is_there_already",
        "tests/session/test_inside.py::test_the_tasks_of_a_worker_read_nothing_from_elsewhere",
        "tests/session/test_inside.py::test_a_followers_copy_takes_nothing_from_elsewhere",
    ), paths),
    Row("1", "read a foreign file: raw messages of a follower with a copy",
        ("tests/server/test_raw_paths.py",), lambda: paths() + paths() // 4),
    Row("1", "zip members, names of uploads, devices and pipes, sentences", (
        "tests/session/test_inside.py::test_a_zip_brings_no_file_out_of_the_folder_and_none_in",
        "tests/session/test_inside.py::test_an_upload_stays_in_the_folder_under_every_name",
        "tests/session/test_inside.py::test_a_sentence_tells_the_last_part_of_the_servers_paths_only",
        "tests/scenario/test_scenario.py::test_pipes_and_devices_are_refused_before_they_are_opened",
        "tests/scenario/test_scenario.py::test_files_outside_the_scenarios_and_the_data_folder_are_told",
    )),
    Row("2", "files that unpack to much more than they are", (
        "tests/session/test_hostile_uploads.py", "tests/recording/test_large_files.py",
        "tests/session/test_uploads.py::test_a_zip_that_lies_about_its_sizes_is_counted",
        "tests/jobs/test_limits.py",
    )),
    Row("2, 8", "scenarios with numbers and lists beyond every bound",
        ("tests/cli/test_hostile_numbers.py",)),
    Row("3", "guess codes and cookies from 1 and 20 addresses", (
        "tests/server/test_guessing.py::test_no_guesser_comes_in_and_nobody_who_knows_the_code_is_kept_out",
    ), lambda: GUESSES),
    Row("3", "forged, old and wrong tickets and codes", (
        "tests/server/test_guessing.py::test_the_ticket_of_the_code_alone_no_longer_opens",
        "tests/server/test_guessing.py::test_wrong_tickets_count_as_guesses",
        "tests/server/test_guessing.py::test_the_key_is_random_and_stays_and_is_nobody_elses",
        "tests/server/test_access.py",
    )),
    Row("4", "take all sessions from one address", (
        "tests/server/test_sessions.py::test_one_address_does_not_take_every_session",
        "tests/server/test_sessions.py::test_a_loop_of_connections_leaves_room_for_others",
        "tests/server/test_sessions.py::test_a_session_in_which_nothing_was_done_is_given_up_soon",
    )),
    Row("5", "frames with invalid UTF-8, random frames", (
        "tests/server/test_guard.py::test_frames_that_are_no_message_are_refused_without_a_word",
    ), lambda: sum(map(len, FRAMES.values())) // len(FRAMES)),
    Row("5", "wrong values and messages", (
        "tests/server/test_guard.py::test_bad_values_change_nothing_and_kill_nothing",
        "tests/server/test_safety_served.py::test_wrong_values_change_nothing_and_end_nothing",
    ), lambda: len(BAD)),
    Row("6", "zips with wrong bytes, in data and directory", (
        "tests/session/test_uploads.py::test_a_zip_with_wrong_bytes_is_refused_in_words_or_read",
    ), lambda: 100),
    Row("7", "compiled code that is emptied, halved or changed; no room for it",
        ("tests/arm/test_cache.py",)),
    Row("8", "command lines, tables and scenarios spoilt in one place",
        ("tests/cli/test_bad_input.py",)),
    Row("8", "mutated tables, scenarios, archives and command lines", ("tests/cli/test_fuzz.py",)),
    Row("9", "SIGKILL of the server after upload, edit and fit; damaged work", (
        "tests/server/test_safety_served.py::test_upload_edit_and_fit_survive_a_kill",
        "tests/session/test_keeping.py",
    )),
    Row("9", "SIGKILL and SIGSTOP of the worker under a job",
        ("tests/session/test_lost_workers.py",), long=True),
    Row("9", "a worker that is killed or stopped: told and replaced", (
        "tests/jobs/test_hanging.py",
        "tests/jobs/test_pool.py::test_a_killed_worker_is_told_and_replaced",
        "tests/session/test_studying.py::test_a_killed_worker_costs_no_case",
    )),
    Row("10", "a hand that is faster than the server; threads of sessions", (
        "tests/server/test_guard.py::test_a_fast_hand_waits_in_the_queue_once_per_input",
        "tests/server/test_guard.py::test_a_drag_that_the_server_could_not_follow_is_answered_by_its_last_place",
        "tests/session/test_scheduling.py",
        "tests/server/test_viser_patches.py",
    )),
    Row("10", "visits that leave threads, descriptors or folders",
        ("tests/server/test_leaving.py",), lambda: 8),
    Row("11", "an own copy in a small window", (
        "tests/server/test_browser_sessions.py::test_a_copy_in_a_small_window_is_a_live_page",
    )),
    Row("11", "a controller with rows of gains on the first stage", (
        "tests/page/test_arm.py::test_a_controller_with_rows_of_gains_has_no_slider_of_them",
    )),
    Row("11", "two who ask for a diagnosis at the same moment", (
        "tests/session/test_diagnosing.py::test_two_who_ask_at_the_same_moment_do_not_take_each_others_look_away",
    )),
    Row("11", "a population's cost on one thread", (
        "tests/identify/test_population.py::test_a_process_with_one_core_to_itself_gets_no_second_thread",
    )),
    Row("11", "seeded noise beside another sensor", (
        "tests/plugins/test_one_file.py::test_a_sensor_is_one_file_and_the_noise_of_the_others_stays",
    )),
    Row("11", "formulas that are tried; hostile ones", (
        "tests/forces/test_law.py::test_a_formula_that_is_tried_leaves_no_file_no_module_and_no_compiled_code",
        "tests/effects/test_hostile_formulas.py::test_a_thousand_hostile_formulas_are_refused_and_none_is_evaluated",
    ), lambda: (HOSTILE + 1) // 2),
    Row("12", "a challenge while its worker is slow", (
        "tests/page/test_diagnose.py::test_a_challenge_with_real_clicks",
    )),
)  # fmt: skip


def asked(items: list[str] | None) -> list[Row]:
    """All rows, or those of some items."""
    return [row for row in ROWS if not items or set(items) & set(row.item.split(", "))]


class Ledger:
    """Hears from pytest how each test ended."""

    def __init__(self) -> None:
        self.ends: dict[str, str] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """The worst of its parts counts."""
        counts = report.when == "call" or report.outcome != "passed"
        if counts and self.ends.get(report.nodeid) != "failed":
            self.ends[report.nodeid] = report.outcome


def of(row: Row, ends: dict[str, str]) -> Counter[str]:
    """How the cases of a row ended."""
    mine = [
        end
        for node, end in ends.items()
        if any(node == test or node.startswith((f"{test}::", f"{test}[")) for test in row.tests)
    ]
    return Counter(mine)


def told(row: Row, found: Counter[str]) -> str:
    """One line of the table."""
    cases = found["passed"] + found["failed"]
    skipped = f", {found['skipped']} skipped" if found["skipped"] else ""
    tries = cases * row.each()
    files = ", ".join(dict.fromkeys(test.partition("::")[0] for test in row.tests))
    return f"| {row.item} | {row.what} | {tries} | {found['failed']}{skipped} | {files} |"


def main() -> int:
    parser = argparse.ArgumentParser(description="What was once open or fragile, tried again.")
    parser.add_argument("--quick", action="store_true", help="without the rows of minutes")
    parser.add_argument("--processes", default="2")
    parser.add_argument("--items", nargs="*", metavar="NUMBER", help="only rows of these items")
    wanted = parser.parse_args()
    rows = [row for row in asked(wanted.items) if not (wanted.quick and row.long)]
    if not rows:
        parser.error("no such row; items are " + ", ".join(dict.fromkeys(row.item for row in ROWS)))
    tests = list(dict.fromkeys(test for row in rows for test in row.tests))
    marks = "not long" if wanted.quick else "long or not long"
    ledger = Ledger()
    options = ["-q", "-m", marks, "-n", wanted.processes, "--dist", "worksteal", "--rootdir", ROOT]
    code = pytest.main([*map(str, options), *tests], plugins=[ledger])
    print("\n| item | tried | tries | failures | tests |\n| --- | --- | ---: | ---: | --- |")
    empty = []
    for row in rows:
        found = of(row, ledger.ends)
        print(told(row, found))
        if not found["passed"] + found["failed"]:
            empty.append(row.what)
    failures = sum(end == "failed" for end in ledger.ends.values())
    print(f"\n{len(ledger.ends)} cases, {failures} failures.")
    for what in empty:
        print(f"Not tried: {what}.")
    return 1 if failures or empty or code else 0


if __name__ == "__main__":
    sys.exit(main())
