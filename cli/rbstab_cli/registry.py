"""The commands of `rbstab`, each imported when it is called, and words that may mean one."""

from collections import Counter
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import click

from rbstab_cli.streams import reader_gone_errors

FIRST_STEPS = "First steps: rbstab init, then rbstab run experiment.yaml."
"""The end of `rbstab --help`."""


COMMANDS = (
    *("init", "examples", "run", "sweep", "check", "show", "list", "compare", "export", "report"),
    *("plot", "stability", "verify", "sensitivities", "tune", "guard", "cache", "schema"),
    "completion",
)
"""The commands, in the order in which a new user needs them."""

STORED = ("show", "list", "compare", "export", "report", "plot")
"""Those that read stored results; they are in a room of their own."""

MEANT = {
    "prove": "stability",
    "simulate": "run",
    "validate": "check",
    "new": "init",
    "ls": "list",
    "diff": "compare",
    "convert": "export",
    "view": "show",
    "figure": "plot",
    "optimize": "tune",
    "version": "--version",
}
"""The commands that are meant by words of other programs."""

HELP = "help"
"""The word that prints the help, as in other programs; it is no command in the list."""

SET = "--set"


class Registry(click.Group):
    """A group whose command NAME is the object `command` in the module NAME of its room."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return a command; return None for an unknown name."""
        if cmd_name not in COMMANDS:
            return None
        room = "commands.stored" if cmd_name in STORED else "commands"
        command: click.Command = import_module(f"rbstab_cli.{room}.{cmd_name}").command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands into the help."""
        commands = filter(None, (self.get_command(ctx, name) for name in COMMANDS))
        rows = [(str(one.name), one.get_short_help_str(limit=200)) for one in commands]
        with formatter.section("Commands"):
            formatter.write_dl(rows)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return a command and its arguments; refuse words that click would accept or not explain.

        For an unknown name, say what was likely meant; `help` means --help.
        """
        first, *words = args
        if ctx.resilient_parsing or first.startswith("-"):
            return super().resolve_command(ctx, args)
        if first == HELP:
            self._print_help(ctx, words)
        command = self.get_command(ctx, first)
        if command is None:
            ctx.fail(_unknown_command(first))
        _refuse_words(command, click.Context(command, ctx, first), words)
        return first, command, words

    def _print_help(self, ctx: click.Context, words: list[str]) -> None:
        """Print the help of the program, or of the command that a word names, and end."""
        command = self.get_command(ctx, words[0]) if words else None
        if words and command is None:
            ctx.fail(_unknown_command(words[0]))
        shown = ctx if command is None else click.Context(command, ctx, words[0])
        click.echo(shown.get_help())
        ctx.exit()

    # click itself ends with exit code 1 if stdout is a closed pipe.
    @reader_gone_errors()
    def make_context(self, *arguments: Any, **options: Any) -> click.Context:
        """Parse the command line; --help prints here."""
        return super().make_context(*arguments, **options)

    @reader_gone_errors()
    def invoke(self, ctx: click.Context) -> Any:
        """Run the command."""
        return super().invoke(ctx)


def _unknown_command(name: str) -> str:
    """Return a message about a word that is not a command: a misspelt one, or a file."""
    path = Path(name)
    suffix = path.suffix.lower()
    if suffix in {".yaml", ".yml", ".h5"}:
        from rbstab.files.shell_words import shell_word
        from rbstab.report.reading.not_results import PLAN, what_it_is

        task = "Run this config: rbstab run"
        if what_it_is(path) == PLAN:
            task = "Run this plan: rbstab sweep"
        if suffix == ".h5":
            task = "Look at this result: rbstab show"
        return f"{name} is not a command. {task} {shell_word(path)}"
    from difflib import get_close_matches

    close = get_close_matches(name.lower(), [*COMMANDS, *MEANT], n=1)
    hint = f" Did you mean {MEANT.get(close[0], close[0])}?" if close else ""
    return f"No such command '{name}'.{hint}"


def _refuse_words(command: click.Command, context: click.Context, words: Sequence[str]) -> None:
    """Refuse an option with one value that is given twice, an empty path, and a key as an option.

    Flags may be repeated: that changes nothing. An empty path is usually a variable of a shell
    without a value; pathlib would take it for the working folder.

    Raises:
        UsageError: There is such a word.
    """
    try:
        values, _, given = command.make_parser(context).parse_args(list(words))
    except click.NoSuchOption as error:
        _refuse_key(error.option_name, command, context)
        return
    except click.UsageError:
        return  # the command itself reports what else is wrong with its words
    for option, count in Counter(filter(_takes_one_value, given)).items():
        if count > 1:
            raise click.UsageError(
                f"{max(option.opts, key=len)} is given {count} times, and takes one value.", context
            )
    for parameter in command.params:
        value = values.get(str(parameter.name))
        empty = "" in value if isinstance(value, list | tuple) else value == ""
        if isinstance(parameter.type, click.Path) and empty:
            name = parameter.get_error_hint(context)
            raise click.UsageError(f"{name} is empty: expected a path.", context)


def _takes_one_value(parameter: click.Parameter) -> bool:
    return isinstance(parameter, click.Option) and not (
        parameter.multiple or parameter.is_flag or parameter.count
    )


def _refuse_key(unknown: str, command: click.Command, context: click.Context) -> None:
    """Say how a key is changed whose name is used as an option: `--duration`."""
    if not unknown.startswith("--") or not any(SET in one.opts for one in command.params):
        return
    # Imported late: the schema takes a while.
    from rbstab.config.errors import keys_named
    from rbstab.config.known_keys import keys_of_variants

    keys = keys_named(unknown.lstrip("-"), keys_of_variants())
    if keys:
        ways = " or ".join(f"{SET} {key}=VALUE" for key in keys)
        raise click.UsageError(f"No such option '{unknown}'. Change the config: {ways}", context)
