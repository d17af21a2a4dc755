"""The command `rbstab`: its subcommands, each imported only when it is called."""

import os
import sys
from contextlib import suppress
from importlib import import_module
from pathlib import Path

import click

from rbstab_cli import exit_codes

COMMANDS = {
    "run": "Integrate configs and store their results.",
    "sweep": "Run all members of a plan and store what becomes of them.",
    "gather": "Join the shards of a sweep that were computed in parts.",
    "check": "Say whether configs are right, and what is wrong with them.",
    "show": "Show what a result holds.",
    "report": "Make a report of runs and sweeps.",
    "stability": "Say what is proved, what is only seen and what is false of configs.",
    "sensitivities": "Say how a run depends on its gains, its body and its start.",
    "tune": "Scale gains so that an objective of the run becomes small.",
    "schema": "Print the JSON Schema of a config, for editors.",
    "completion": "Print the completion script of a shell.",
}
"""The subcommands and their one-line help: `rbstab --help` must not import them."""


class LazyGroup(click.Group):
    """A group whose command NAME is the object `command` of `rbstab_cli.commands.NAME`."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The names, in the order of a first session."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Imports one command."""
        if cmd_name not in COMMANDS:
            return None
        command: click.Command = import_module(f"rbstab_cli.commands.{cmd_name}").command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The list of commands in the help."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


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
    not be written or read; 130 interrupted.
    """


def _replace_closed_streams() -> None:
    """Where a process was started without stdout or stderr, Python has None there."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open("w"))  # noqa: SIM115 (it stays open)


def main() -> None:
    """Runs the command line and ends the process with its exit code."""
    _replace_closed_streams()
    try:
        code = cli.main(prog_name="rbstab", standalone_mode=False)
    except click.ClickException as error:
        error.show()
        code = error.exit_code
    except (click.Abort, KeyboardInterrupt):
        click.echo("Interrupted.", err=True)
        code = exit_codes.INTERRUPTED
    except BrokenPipeError:
        # The reader of our output is gone, as after `| head`; nothing is left to be said to it.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = exit_codes.OK
    except OSError as error:
        # A full disk behind stdout, say; results have their own errors.
        with suppress(OSError):
            click.echo(f"error: {error}", err=True)
        code = exit_codes.STORAGE
    sys.exit(code if isinstance(code, int) else exit_codes.OK)
