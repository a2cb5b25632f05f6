"""The command line: exit codes, one-sentence errors, a quick start, progress."""

from __future__ import annotations

import io
import subprocess
import sys
import time
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from rich.console import Console
from typer.testing import CliRunner, Result

from flexgui import __version__
from flexgui.cli import app
from flexgui.core.errors import InputError
from flexgui.core.progress import Progress, Silent
from flexgui.core.results import Generation, Outcome
from flexgui.core.scenario.schema import Scenario
from flexgui.progress import PlainProgress, TerminalProgress
from tests.cli.helpers import FILE, TEXT, csv, table


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    path = tmp_path / "case.toml"
    recording = 'recordings = [{ name = "a", simulate = { theta2 = 1.0, seconds = 0.1 } }]'
    rig = 'arm = { preset = "paper" }\ndrive = { kind = "velocity_loop", gains = [60.0, 30.0] }'
    path.write_text(f'title = "case"\n{rig}\n{recording}\n', encoding="utf-8")
    return path


@pytest.fixture
def workbench(monkeypatch: pytest.MonkeyPatch, glocal: Outcome) -> list[object]:
    """A workbench that notes what it is given and answers at once; or raises what it holds."""
    calls: list[object] = []
    bench = ModuleType("flexgui.core.workbench")

    def run_scenario(
        given: Scenario, *, folder: Path, data_folder: Path | None, progress: Progress, check: bool
    ) -> Outcome:
        for call in calls:
            if isinstance(call, BaseException):
                raise call
        calls.append((given.title, data_folder, progress))
        return glocal

    bench.run_scenario = run_scenario
    monkeypatch.setattr("flexgui.core.scenario.stated_effects.arms_to_compile", lambda given: ())
    # The motion in 3-D would be simulated by the workbench that is not there.
    monkeypatch.setattr("flexgui.export.export_files.report_motion", lambda *given: None)
    monkeypatch.setitem(sys.modules, "flexgui.core.workbench", bench)
    return calls


def test_export_writes_the_folder(scenario: Path, workbench: list, tmp_path: Path) -> None:
    result = run("export", scenario, "--out", tmp_path / "out", "--data", tmp_path)
    assert result.exit_code == 0, result.output
    assert (tmp_path / "out" / "report.html").exists()
    (given, folder, progress) = workbench[0]
    assert (given, folder) == ("case", tmp_path)
    assert isinstance(progress, Silent)


def test_bad_input_is_one_sentence_and_2_and_an_interrupt_130(
    scenario: Path, workbench: list, tmp_path: Path
) -> None:
    workbench.append(InputError("th1.csv, row 7, column theta1:\nnot a number; correct it."))
    result = run("export", scenario, "--out", tmp_path / "out")
    assert result.exit_code == 2
    assert result.stderr == "flexgui: th1.csv, row 7, column theta1: not a number; correct it.\n"
    assert not (tmp_path / "out").exists()
    workbench[:] = [KeyboardInterrupt()]
    result = run("export", scenario, "--out", tmp_path / "out")
    assert result.exit_code == 130 and "nothing was overwritten" in result.stderr


def test_wrong_usage_is_2_and_the_version_is_printed() -> None:
    assert run("--version").output.strip() == f"flexgui {__version__}"
    assert run("export").exit_code == 2
    assert run("no-such-command").exit_code == 2


def test_a_slip_is_told_before_what_computes_is_imported(tmp_path: Path) -> None:
    named = tmp_path / "wrong.toml"
    named.write_text(TEXT.replace('"EI2"]', '"EI9"]'))
    (tmp_path / FILE).write_text(csv(table()))
    out = ["--out", str(tmp_path / "out")]
    tried = [
        [command, slip, *rest]
        for command, rest in (("export", out), ("check", []), ("plan", out))
        for slip in (str(named), str(tmp_path / "none.toml"), "teaching/frictoin", "frictoin")
    ]
    tried += [["study", "frictoin"], ["serve", "--scenario", "frictoin", "--no-browser"]]
    code = (
        "import sys; from flexgui.cli import run\n"
        f"assert {{run(each) for each in {tried!r}}} == {{2}}\n"
        "names = ('loading', 'simulate.batch', 'check.run_checks')\n"
        "core = [f'flexgui.core.{name}' for name in names]\n"
        "heavy = (*core, 'plotly', 'pandas')\n"
        "print([name for name in heavy if name in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.strip() == "[]"
    assert done.stderr.count("did you mean 'teaching/friction'") == 3
    assert done.stderr.count("did you mean 'hidden_friction'") == 5
    assert done.stderr.count("'EI9' is not a parameter of this arm") == 3


def test_elsewhere_a_plain_line_says_what_is_done(capsys: pytest.CaptureFixture[str]) -> None:
    said = ""
    with PlainProgress(every=0.001) as progress:
        progress.stage("Fitting", total=2)
        progress.advance()
        while "Fitting, 1 of 2 (0 s)\n" not in said:
            said += capsys.readouterr().err
    assert all(line.startswith("flexgui: ") for line in said.splitlines())


def test_while_one_step_takes_long_its_simulations_are_counted(
    capsys: pytest.CaptureFixture[str],
) -> None:
    said = ""
    with PlainProgress(every=0.001) as progress:
        progress.stage("Before")
        progress.simulated(7)
        progress.stage("Fitting", total=2)
        progress.advance()
        progress.simulated(1000)
        progress.simulated(234)
        while "Fitting, 1 of 2, 1,234 simulations (0 s)\n" not in said:
            said += capsys.readouterr().err
    screen = io.StringIO()
    with TerminalProgress(Console(file=screen, force_terminal=True, width=100)) as bars:
        bars.stage("Fitting", total=2)
        bars.advance(text="th1")
        bars.simulated(1234)
        while "th1, 1,234 simulations" not in screen.getvalue():
            time.sleep(0.01)


def test_the_terminal_shows_stages_and_generations() -> None:
    screen = io.StringIO()
    console = Console(file=screen, force_terminal=True, width=100)
    with TerminalProgress(console):
        pass
    assert screen.getvalue() == "", "without a stage it stays as it was"
    with TerminalProgress(console) as progress:
        progress.stage("Fitting", total=2)
        progress.advance(text="th1")
        progress.generation("glocal", Generation(3, 1.25, 2.0, 3.0, np.zeros(2)))
        progress.stage("Writing")
        progress.advance()
    text = screen.getvalue()
    assert "Fitting" in text
    assert "Writing" in text
