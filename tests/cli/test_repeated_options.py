"""Protects options that are given twice: none of their values is dropped without a word."""

from collections.abc import Iterator

import click
import pytest
from cli.conftest import Invoke

from rbstab_cli.main import COMMANDS, cli


def options_with_one_value() -> Iterator[tuple[str, str]]:
    """Yield the name of each command with each of its options that takes one value."""
    context = click.Context(cli)
    for name in COMMANDS:
        command = cli.get_command(context, name)
        assert command is not None
        for option in command.params:
            if isinstance(option, click.Option) and option.nargs == 1 and not option.is_flag:
                yield from ((name, spelling) for spelling in option.opts if not option.multiple)


@pytest.mark.parametrize(("command", "option"), [*options_with_one_value()])
def test_one_value_given_twice_is_refused(rbstab: Invoke, command: str, option: str) -> None:
    done = rbstab(command, option, "a", option, "b")
    assert done.exit_code == 2
    assert done.stderr.startswith(f"Usage: rbstab {command} ")
    assert " is given 2 times, and takes one value.\n" in done.stderr


def test_two_spellings_are_one_option(rbstab: Invoke) -> None:
    done = rbstab("run", "good.yaml", "-o", "a", "--output", "b")
    assert "Error: --output is given 2 times" in done.stderr


def test_flags_and_repeatable_options_may_be_repeated(rbstab: Invoke, folder: object) -> None:
    changes = ("--set", "body.mass=50", "--set", "title=Two changes")
    done = rbstab("check", "good.yaml", *changes, "-q", "-q")
    assert done.exit_code in (0, 2)
    assert "is given" not in done.stderr
    assert rbstab("check", "good.yaml", *changes).exit_code == 0
