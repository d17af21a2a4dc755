"""The commands of `rbstab`, each imported when it is called, and words that may mean one."""

from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any

import click

from rbstab_cli.streams import reader_gone_errors

FIRST_STEPS = "First steps: rbstab init, then rbstab run experiment.yaml."
"""The end of `rbstab --help`."""


COMMANDS = {
    **dict.fromkeys(("init", "examples"), "beginning"),
    **dict.fromkeys(("run", "sweep"), "running"),
    "check": "beginning",
    **dict.fromkeys(("show", "list", "compare", "export", "report", "plot"), "stored"),
    **dict.fromkeys(("stability", "verify"), "proofs"),
    **dict.fromkeys(("sensitivities", "tune", "fit", "guard"), "tuning"),
    **dict.fromkeys(("cache", "schema", "completion"), "beginning"),
}
"""The commands with their modules, in the order in which a new user needs them."""

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


class Registry(click.Group):
    """A group whose commands are imported when they are called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return a command; return None for an unknown name."""
        if cmd_name not in COMMANDS:
            return None
        module = import_module(f"rbstab_cli.commands.{COMMANDS[cmd_name]}")
        commands = (
            command for command in vars(module).values() if isinstance(command, click.Command)
        )
        return next(command for command in commands if command.name == cmd_name)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands into the help."""
        commands = filter(None, (self.get_command(ctx, name) for name in COMMANDS))
        rows = [(str(command.name), command.get_short_help_str(limit=200)) for command in commands]
        with formatter.section("Commands"):
            formatter.write_dl(rows)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return a command and its arguments; `help` means --help.

        For an unknown name, say what was likely meant.
        """
        first, *words = args
        if ctx.resilient_parsing or first.startswith("-"):
            return super().resolve_command(ctx, args)
        if first == HELP and not words:
            click.echo(ctx.get_help())
            ctx.exit()
        if first == HELP:
            first, words = words[0], ["--help"]
        if first not in COMMANDS:
            ctx.fail(_unknown_command(first))
        return super().resolve_command(ctx, [first, *words])

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
        from rbstab.files.text import shell_word
        from rbstab.report.reading.kinds import Kind, kind_of
        from rbstab.store.errors import StoreError

        task = "Run this config: rbstab run"
        with suppress(StoreError):
            if kind_of(path) is Kind.PLAN:
                task = "Run this plan: rbstab sweep"
        if suffix == ".h5":
            task = "Look at this result: rbstab show"
        return f"{name} is not a command. {task} {shell_word(path)}"
    from difflib import get_close_matches

    close = get_close_matches(name.lower(), [*COMMANDS, *MEANT], n=1)
    hint = f" Did you mean {MEANT.get(close[0], close[0])}?" if close else ""
    return f"No such command '{name}'.{hint}"
