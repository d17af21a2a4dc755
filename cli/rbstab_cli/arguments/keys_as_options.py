"""Options that are named like a key of a config, such as `--duration`: say how a key is changed."""

from collections.abc import Sequence

import click

SET = "--set"


def refuse_keys(command: click.Command, context: click.Context, words: Sequence[str]) -> None:
    """Refuse an unknown option that is named like a key of a config, if the command has `--set`.

    Args:
        command: The command that will parse the words.
        context: Its context.
        words: The command line after the name of the command.

    Raises:
        UsageError: There is such an option; the message has the key.
    """
    if not any(SET in option.opts for option in command.params):
        return
    unknown = _unknown_option(command, context, words)
    if not unknown.startswith("--"):
        return
    # Imported late: the schema takes a while.
    from rbstab.config.errors import keys_named
    from rbstab.config.known_keys import keys_of_variants

    keys = keys_named(unknown.lstrip("-"), keys_of_variants())
    if keys:
        ways = " or ".join(f"{SET} {key}=VALUE" for key in keys)
        raise click.UsageError(f"No such option '{unknown}'. Change the config: {ways}", context)


def _unknown_option(command: click.Command, context: click.Context, words: Sequence[str]) -> str:
    """Return the first unknown option of a command line, or an empty text."""
    try:
        command.make_parser(context).parse_args(list(words))
    except click.NoSuchOption as error:
        return error.option_name
    except click.UsageError:
        # The command itself reports what else is wrong with its words.
        return ""
    return ""
