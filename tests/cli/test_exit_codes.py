"""Protects the exit codes: the docs list all of them, and each one means what it is said to mean.

Those of interrupts and of closed pipes are tested with the processes that end so.
"""

import re
import sys
from pathlib import Path

import pytest
from cli.conftest import Invoke

from rbstab_cli import exit_codes, main
from rbstab_cli.arguments import configs

ROOT = Path(__file__).parents[2]


def test_the_docs_and_the_help_list_every_code(rbstab: Invoke) -> None:
    codes = {value for name, value in vars(exit_codes).items() if name.isupper()}
    table = (ROOT / "docs/commands.md").read_text(encoding="utf-8").partition("## Exit codes")[2]
    assert {int(code) for code in re.findall(r"^\| (\d+) \|", table, re.MULTILINE)} == codes
    told = " ".join(rbstab("--help").stdout.split()).partition("Exit codes:")[2]
    assert {int(code) for code in re.findall(r"(?:^|; ) ?(\d+) ", told)} == codes


def ended(monkeypatch: pytest.MonkeyPatch, *words: str) -> object:
    """Return the exit code of the program in this process."""
    monkeypatch.setattr(sys, "argv", ["rbstab", *words])
    for name in ("prepare_streams", "handle_interrupts", "stop_handling"):
        monkeypatch.setattr(main, name, lambda: None)
    with pytest.raises(SystemExit) as caught:
        main.main()
    return caught.value.code


@pytest.mark.usefixtures("folder")
def test_the_codes_of_commands(monkeypatch: pytest.MonkeyPatch) -> None:
    short = ("run", "good.yaml", "--no-prove", "-q")
    assert ended(monkeypatch, "check", "good.yaml") == exit_codes.OK
    assert ended(monkeypatch, "check", "missing.yaml") == exit_codes.USAGE
    assert ended(monkeypatch, "run") == exit_codes.USAGE
    # At 50 rad/s the body leaves the range of θ2 within the tenth of a second.
    spin = ("--set", "initial.angular_velocity=[0, 50, 0]")
    assert ended(monkeypatch, *short, *spin) == exit_codes.NOT_COMPLETED
    assert ended(monkeypatch, "show", "missing.h5") == exit_codes.STORAGE


@pytest.mark.usefixtures("folder")
def test_an_unexpected_error_is_not_hidden(monkeypatch: pytest.MonkeyPatch) -> None:
    """Python prints its traceback and ends with `exit_codes.INTERNAL`."""

    def fail(*_: object, **__: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(configs, "print_warnings", fail)
    monkeypatch.setattr("rbstab.config.warnings.config_warnings", fail)
    with pytest.raises(ZeroDivisionError):
        ended(monkeypatch, "check", "good.yaml")
