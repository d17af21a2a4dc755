"""Words that click would accept without a word: an option given twice, and an empty path."""

from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import click


def refuse_repeated(command: click.Command, context: click.Context, words: Sequence[str]) -> None:
    """Refuse options that are given more than once although they take one value, and empty paths.

    Flags may be repeated: that changes nothing. An empty path is usually a variable of a shell
    without a value; pathlib would take it for the working folder.

    Args:
        command: The command that will parse the words.
        context: Its context.
        words: The command line after the name of the command.

    Raises:
        UsageError: An option with one value is repeated, or a path is empty.
    """
    parser = command.make_parser(context)
    given: Sequence[click.Parameter] = ()
    values: Mapping[str, Any] = {}
    # The command itself reports what else is wrong with its words.
    with suppress(click.UsageError):
        values, _, given = parser.parse_args(list(words))
    for option, count in Counter(filter(_takes_one_value, given)).items():
        if count > 1:
            raise click.UsageError(
                f"{max(option.opts, key=len)} is given {count} times, and takes one value.", context
            )
    for parameter in command.params:
        if isinstance(parameter.type, click.Path) and _has_empty(values.get(str(parameter.name))):
            name = parameter.get_error_hint(context)
            raise click.UsageError(f"{name} is empty: expected a path.", context)


def _has_empty(value: Any) -> bool:
    return value == "" or (isinstance(value, list | tuple) and "" in value)


def _takes_one_value(parameter: click.Parameter) -> bool:
    return isinstance(parameter, click.Option) and not (
        parameter.multiple or parameter.is_flag or parameter.count
    )
