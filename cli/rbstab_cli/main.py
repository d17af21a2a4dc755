"""The command `rbstab`. Each subcommand is imported only when it is called."""

import sys
from contextlib import suppress
from importlib import import_module
from typing import Any

import click

from rbstab_cli import exit_codes
from rbstab_cli.interrupts import handle_interrupts, interrupted_code, stop_handling
from rbstab_cli.streams import (
    ReaderGoneError,
    discard_output,
    flush_streams,
    prepare_streams,
    reader_gone_errors,
)

COMMANDS = {
    "run": "Integrate configs and store their results.",
    "sweep": "Run all members of a plan and store their outcomes.",
    "gather": "Gather the shards of a sweep into one file.",
    "check": "Check configs and list their errors.",
    "show": "Show the content of a result.",
    "report": "Make a report of runs and sweeps.",
    "plot": "Draw one figure of runs and sweeps, or write its data.",
    "stability": "Find the rest states of configs, and prove where motions converge.",
    "verify": "Check a proof by a program of its own.",
    "sensitivities": "Compute how a run depends on its gains, its body and its initial state.",
    "tune": "Scale gains to minimize an objective of the run.",
    "guard": "Find a barrier of θ2 with which every start is proved to converge.",
    "cache": "Show the cache of compiled code, or clear it.",
    "upgrade": "Rewrite configs of schema version 1 as version 2.",
    "schema": "Print the JSON Schema of a config, for editors.",
    "completion": "Print the completion script of a shell.",
}
"""The subcommands and their one-line help, which `rbstab --help` prints without importing them."""


class LazyGroup(click.Group):
    """A group whose command NAME is the object `command` in `rbstab_cli.commands.NAME`."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names, in the order in which a new user needs them."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return a command; return None for an unknown name."""
        if cmd_name not in COMMANDS:
            return None
        command: click.Command = import_module(f"rbstab_cli.commands.{cmd_name}").command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands into the help."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))

    # click itself ends with exit code 1 if stdout is a closed pipe.
    @reader_gone_errors()
    def make_context(self, *arguments: Any, **options: Any) -> click.Context:
        """Parse the command line; --help prints here."""
        return super().make_context(*arguments, **options)

    @reader_gone_errors()
    def invoke(self, ctx: click.Context) -> Any:
        """Run the command."""
        return super().invoke(ctx)


def _print_version(ctx: click.Context, _parameter: click.Parameter, value: bool) -> None:
    if not value:
        return
    from importlib.metadata import version

    click.echo(f"rbstab {version('rbstab')}")
    ctx.exit()


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
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

    Exit codes: 0 done; 2 wrong config or command line; 3 a run did not complete; 4 a result could
    not be written or read, or a proof was refused; 130 interrupted (Ctrl-C); 141 stdout or stderr
    is a pipe whose reader has ended, as in `rbstab show RESULT | head`; 143 terminated (SIGTERM).
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
    if code == exit_codes.INTERRUPTED:
        code = interrupted_code()
    return code if isinstance(code, int) else exit_codes.OK


def _reason(error: OSError) -> str:
    reason = error.strerror or str(error)
    if error.filename is None:
        return f"the output cannot be written: {reason}"
    return f"{error.filename}: {reason}"
