"""The command `rbstab`. Each subcommand is imported only when it is called."""

import sys
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any

import click

from rbstab_cli import exit_codes
from rbstab_cli.arguments.keys_as_options import refuse_keys
from rbstab_cli.arguments.repeated import refuse_repeated
from rbstab_cli.help_examples import FIRST_STEPS, example_of
from rbstab_cli.interrupts import handle_interrupts, interrupted_code, stop_handling
from rbstab_cli.streams import (
    ReaderGoneError,
    discard_output,
    flush_streams,
    prepare_streams,
    reader_gone_errors,
)

COMMANDS = {
    "init": "Write a first config and a plan, or a template of an element of your own.",
    "examples": "List the configs and plans that come with the program, or copy them.",
    "run": "Integrate configs and store their results.",
    "sweep": "Run all members of a plan and store their outcomes.",
    "gather": "Gather the shards of a sweep into one file.",
    "check": "Check configs and plans and list their errors, or test elements of your own.",
    "show": "Show the content of a result.",
    "list": "List the runs and sweeps in a folder of results, the newest first.",
    "compare": "Compare two results: what was run, and what came out.",
    "export": "Write runs, or a sweep, as a table for other programs.",
    "report": "Make a report of runs and sweeps.",
    "plot": "Draw one figure of runs and sweeps, or write its data.",
    "stability": "Find the rest states of configs, and prove where motions converge.",
    "verify": "Check proofs by a program of its own.",
    "sensitivities": "Compute how a run depends on its gains, its body and its initial state.",
    "tune": "Scale gains to minimize an objective of the run.",
    "guard": "Find a guard of θ2 with which motions are proved to keep the range.",
    "cache": "Show the cache of compiled code, or clear it.",
    "schema": "Print the JSON Schema of a config, for editors.",
    "completion": "Print the completion script of a shell.",
}
"""The subcommands and their one-line help, which `rbstab --help` prints without importing them."""

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

ROOMS = {
    "init": "beginning",
    "examples": "beginning",
    "list": "stored",
    "compare": "stored",
    "export": "stored",
    "completion": "texts",
    "schema": "texts",
}
"""The rooms in `rbstab_cli.commands` of the commands that are not in it itself."""


class LazyGroup(click.Group):
    """A group whose command NAME is the object `command` in `rbstab_cli.commands.NAME`.

    The module may be in a room of `rbstab_cli.commands`, see `ROOMS`.
    """

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names, in the order in which a new user needs them."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return a command; return None for an unknown name."""
        if cmd_name not in COMMANDS:
            return None
        module = ".".join(filter(None, ("rbstab_cli.commands", ROOMS.get(cmd_name), cmd_name)))
        command: click.Command = import_module(module).command
        command.epilog = example_of(cmd_name)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands into the help."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return a command and its arguments; refuse options that are given twice.

        For an unknown name, say what was likely meant; `help` means --help.
        """
        if args[0] == HELP and not ctx.resilient_parsing:
            _print_help(ctx, args[1:])
        if args[0] not in COMMANDS and not args[0].startswith("-") and not ctx.resilient_parsing:
            ctx.fail(_unknown_command(args[0]))
        name, command, words = super().resolve_command(ctx, args)
        if command is not None and not ctx.resilient_parsing:
            context = click.Context(command, ctx, name)
            refuse_repeated(command, context, words)
            refuse_keys(command, context, words)
        return name, command, words

    # click itself ends with exit code 1 if stdout is a closed pipe.
    @reader_gone_errors()
    def make_context(self, *arguments: Any, **options: Any) -> click.Context:
        """Parse the command line; --help prints here."""
        return super().make_context(*arguments, **options)

    @reader_gone_errors()
    def invoke(self, ctx: click.Context) -> Any:
        """Run the command."""
        return super().invoke(ctx)


def _print_help(ctx: click.Context, words: list[str]) -> None:
    """Print the help of the program, or of the command that a word names, and end."""
    command = cli.get_command(ctx, words[0]) if words else None
    if words and command is None:
        ctx.fail(_unknown_command(words[0]))
    shown = ctx if command is None else click.Context(command, ctx, words[0])
    click.echo(shown.get_help())
    ctx.exit()


def _unknown_command(name: str) -> str:
    """Return a message about a word that is not a command: a misspelt one, or a file."""
    from difflib import get_close_matches

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
    close = get_close_matches(name.lower(), [*COMMANDS, *MEANT], n=1)
    if close:
        return f"No such command '{name}'. Did you mean {MEANT.get(close[0], close[0])}?"
    return f"No such command '{name}'."


def _print_version(ctx: click.Context, _parameter: click.Parameter, value: bool) -> None:
    if not value:
        return
    from importlib.metadata import version

    click.echo(f"rbstab {version('rbstab')}")
    ctx.exit()


@click.group(
    cls=LazyGroup, epilog=FIRST_STEPS, context_settings={"help_option_names": ["-h", "--help"]}
)
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_print_version,
    help="Show the version and exit.",
)
def cli() -> None:
    """Dynamics and Lyapunov stability of one rigid body: free, held at a point, or tied to it.

    Exit codes: 0 done; 1 an error in rbstab itself; 2 wrong config or command line; 3 a run did not
    complete, or nothing was found; 4 a result could not be written or read, or a proof was refused;
    5 the check of a proof takes too long; 130 interrupted (Ctrl-C); 141 stdout or stderr is a pipe
    whose reader has ended, as in `rbstab show RESULT | head`; 143 terminated (SIGTERM).
    """


def main() -> None:
    """Run the command line and end the process with its exit code."""
    prepare_streams()
    handle_interrupts()
    try:
        code = _flushed_exit_code()
    except KeyboardInterrupt:
        # The command was done; only its last line or the flushing of its output was interrupted.
        code = interrupted_code()
    stop_handling()
    sys.exit(code)


def _flushed_exit_code() -> int:
    """Run the command line, write out all that it printed, and return its exit code."""
    try:
        code = _exit_code()
        flush_streams()
    except (ReaderGoneError, BrokenPipeError):
        # Quietly, as other programs end; what was not printed, run or stored yet is left out.
        code = exit_codes.READER_GONE
        discard_output()
    except OSError as error:
        # For example a full disk behind stdout; results have their own errors.
        code = exit_codes.STORAGE
        with suppress(OSError):
            click.echo(f"error: {_reason(error)}", err=True)
        discard_output()
    return code


def _exit_code() -> int:
    """Run the command line and return its exit code; click's errors are printed."""
    try:
        code = cli.main(prog_name="rbstab", standalone_mode=False)
    except click.ClickException as error:
        error.show()
        code = error.exit_code
    except (click.Abort, KeyboardInterrupt):
        click.echo("Interrupted.", err=True)
        code = exit_codes.INTERRUPTED
    except Exception as error:
        failure = _failure_of_user_code(error)
        if failure is None:
            raise
        click.echo(f"error: {failure}", err=True)
        code = exit_codes.USAGE
    if code == exit_codes.INTERRUPTED:
        code = interrupted_code()
    return code if isinstance(code, int) else exit_codes.OK


def _failure_of_user_code(error: Exception) -> str | None:
    """Return an error in the code of an element of a user as text; None if it is not in one."""
    loaded = sys.modules.get("rbstab.elements.user_code.loaded")
    return None if loaded is None else loaded.failure_in_user_code(error)


def _reason(error: OSError) -> str:
    reason = error.strerror or str(error)
    if error.filename is None:
        return f"the output cannot be written: {reason}"
    return f"{error.filename}: {reason}"
