"""Errors of a command that integrates one config, as messages and exit codes."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from rbstab_cli import exit_codes


@contextmanager
def motion_errors(path: Path) -> Iterator[None]:
    """Print an error of the block; exit with code 2 (unsuited config) or 3 (unfinished run)."""
    from rbstab.experiment.tuning.gain_scaling import TuningError
    from rbstab.experiment.tuning.sensitivities import UnsuitedConfigError
    from rbstab.integrate.engines import EngineMissingError
    from rbstab.integrate.status import UnfinishedRunError

    try:
        yield
    except EngineMissingError as error:
        raise click.UsageError(str(error)) from error
    except TuningError as error:
        raise click.UsageError(f"--over {error}") from error
    except UnsuitedConfigError as error:
        click.echo(f"{path}: {error}", err=True)
        raise click.exceptions.Exit(exit_codes.USAGE) from error
    except UnfinishedRunError as error:
        click.echo(f"{path}: {error}", err=True)
        raise click.exceptions.Exit(exit_codes.NOT_COMPLETED) from error
