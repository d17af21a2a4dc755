"""Protects what long work says of itself: on a terminal, before its first part is done."""

import sys
import time

import pytest

from rbstab.experiment.start_sets.starts_record import MAX_PARTS
from rbstab_cli.output import progress as progress_module
from rbstab_cli.output.progress import simulated_time, starts_proved


def use_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the captured stderr be a terminal of 100 columns."""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("TTY_COMPATIBLE", "1")
    monkeypatch.setenv("COLUMNS", "100")


def test_a_proof_of_all_starts_says_its_bound_and_how_to_stop(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    use_terminal(monkeypatch)
    with starts_proved("one.yaml", wanted=True) as progress:
        progress(0.125, 3)
    shown = capsys.readouterr().err
    for text in (f"at most {MAX_PARTS} parts", "Ctrl-C stops", "one.yaml", "12.5 % proved, 3"):
        assert text in shown


def test_a_run_says_what_is_done_before_its_first_step(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    use_terminal(monkeypatch)
    with simulated_time("one.yaml", 3.0, wanted=True, before="compiling much"):
        pass
    shown = capsys.readouterr().err
    assert "one.yaml" in shown
    assert "compiling much" in shown


@pytest.mark.parametrize(
    ("interval", "wanted", "printed"), [(0.01, True, True), (0.01, False, False), (10, True, False)]
)
def test_lines_where_there_is_no_terminal(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    interval: float,
    wanted: bool,
    printed: bool,
) -> None:
    """Long work prints lines with what it said last, also between its callbacks; short one none."""
    monkeypatch.setattr(progress_module, "LINE_INTERVAL", interval)
    with simulated_time("one.yaml", 3.0, wanted=wanted) as progress:
        progress(1.5)
        time.sleep(0.1)
    lines = capsys.readouterr().err.splitlines()
    assert (len(lines) > 1) == printed
    assert set(lines) <= {"0 s: one.yaml", "0 s: one.yaml, t = 1.5 of 3 s"}
    assert not printed or lines[-1].endswith("t = 1.5 of 3 s")
