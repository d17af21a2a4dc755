"""How a command ends that cannot be done: what it says on stderr, and its exit code."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO, Any

import click

from rbstab_cli import exit_codes


def say(text: str) -> None:
    """Print a line for people: on stderr, beside the data on stdout."""
    click.echo(text, err=True)


class Failed(click.ClickException):
    """The end of a command with an exit code, after lines that say why."""

    def __init__(self, code: int, *lines: str) -> None:
        super().__init__("\n".join(lines))
        self.lines = lines
        self.exit_code: int = code  # type: ignore[misc]

    def show(self, file: IO[Any] | None = None) -> None:
        """Print the lines."""
        for line in self.lines:
            say(line)


class Command(click.Command):
    """A command whose function may return its exit code, and raise the errors of the library."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; end it with its exit code."""
        try:
            code = super().invoke(ctx)
        except (click.ClickException, click.exceptions.Exit, click.Abort):
            raise
        except Exception as error:
            told = _told(error, ctx)
            if told is None:
                raise
            raise told from error
        if code:
            ctx.exit(code)


def _told(error: Exception, context: click.Context) -> click.ClickException | None:
    """Return how the command ends with an error of the library; None: that is a fault in rbstab."""
    # Imported late: a command that can be done needs none of them.
    from rbstab.config.errors import ConfigError
    from rbstab.integrate.engines import EngineMissingError
    from rbstab.store.errors import StoreError
    from rbstab.sweep.folder.open_folder import OtherSweepError

    if isinstance(error, StoreError):
        is_other = isinstance(error, OtherSweepError)
        code = exit_codes.USAGE if is_other else exit_codes.STORAGE
        return Failed(code, f"error: {error}")
    if isinstance(error, ConfigError):
        return Failed(exit_codes.USAGE, *dict.fromkeys(map(str, error.problems)))
    if isinstance(error, EngineMissingError):
        return click.UsageError(str(error), context)
    # Only where code of a user was loaded can an error be in it.
    loaded = sys.modules.get("rbstab.elements.user_code.loaded")
    failure = None if loaded is None else loaded.failure_in_user_code(error)
    return None if failure is None else Failed(exit_codes.USAGE, f"error: {failure}")


@contextmanager
def motion_errors(path: object) -> Iterator[None]:
    """Name the config in errors of a block that integrates it, and those of its gains by --over."""
    from rbstab.experiment.tuning.gain_scaling import TuningError
    from rbstab.experiment.tuning.sensitivities import UnsuitedConfigError
    from rbstab.integrate.status import UnfinishedRunError

    try:
        yield
    except TuningError as error:
        raise click.UsageError(f"--over {error}") from error
    except UnsuitedConfigError as error:
        raise Failed(exit_codes.USAGE, f"{path}: {error}") from error
    except UnfinishedRunError as error:
        raise Failed(exit_codes.NOT_COMPLETED, f"{path}: {error}") from error


def reason_of(error: Exception) -> str:
    """Return what the system says of an error, or else its text."""
    return getattr(error, "strerror", None) or str(error)
