"""Options that take one value, given twice: click would use the last value without a word."""

from collections import Counter
from collections.abc import Sequence
from contextlib import suppress

import click


def refuse_repeated(command: click.Command, context: click.Context, words: Sequence[str]) -> None:
    """Refuse options that are given more than once although they take one value.

    Flags may be repeated: that changes nothing.

    Args:
        command: The command that will parse the words.
        context: Its context.
        words: The command line after the name of the command.

    Raises:
        UsageError: An option with one value is repeated.
    """
    parser = command.make_parser(context)
    given: Sequence[click.Parameter] = ()
    # The command itself reports what else is wrong with its words.
    with suppress(click.UsageError):
        *_, given = parser.parse_args(list(words))
    for option, count in Counter(filter(_takes_one_value, given)).items():
        if count > 1:
            raise click.UsageError(
                f"{max(option.opts, key=len)} is given {count} times, and takes one value.", context
            )


def _takes_one_value(parameter: click.Parameter) -> bool:
    return isinstance(parameter, click.Option) and not (
        parameter.multiple or parameter.is_flag or parameter.count
    )
