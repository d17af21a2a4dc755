"""Protects what long work says of itself: on a terminal, before its first part is done."""

import sys
import time

import pytest

from rbstab_cli.output import progress as progress_module
from rbstab_cli.output.progress import working


def use_terminal(monkeypatch):
    """Let the captured stderr be a terminal of 100 columns."""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("TTY_COMPATIBLE", "1")
    monkeypatch.setenv("COLUMNS", "100")


def test_a_terminal_shows_what_is_done_and_how_far(capsys, monkeypatch):
    use_terminal(monkeypatch)
    with working("one.yaml") as work:
        work.hint("Ctrl-C stops")
        work.update("compiling much")
    shown = capsys.readouterr().err
    for text in ("Ctrl-C stops", "one.yaml", "compiling much"):
        assert text in shown


@pytest.mark.parametrize(
    ("interval", "wanted", "printed"), [(0.01, True, True), (0.01, False, False), (10, True, False)]
)
def test_lines_where_there_is_no_terminal(capsys, monkeypatch, interval, wanted, printed):
    """Long work prints lines with what it said last, also between its callbacks; short one none."""
    monkeypatch.setattr(progress_module, "LINE_INTERVAL", interval)
    monkeypatch.setattr(progress_module, "is_quiet", lambda: not wanted)
    with working("one.yaml") as work:
        work.simulated(3.0)(1.5)
        time.sleep(0.1)
    lines = capsys.readouterr().err.splitlines()
    assert (len(lines) > 1) == printed
    assert set(lines) <= {"0 s: one.yaml", "0 s: one.yaml, t = 1.5 of 3 s"}
    assert not printed or lines[-1].endswith("t = 1.5 of 3 s")
