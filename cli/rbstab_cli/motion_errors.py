"""What keeps a command from following the motion of one config, as messages and exit codes."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from rbstab_cli import exit_codes


@contextmanager
def said_of(path: Path) -> Iterator[None]:
    """Says why a config is not suited (exit code 2) or its run did not complete (3)."""
    from rbstab.experiment.tuning.design import DesignError
    from rbstab.experiment.tuning.sensitivities import UnsuitedConfigError
    from rbstab.integrate.engines import EngineMissingError
    from rbstab.integrate.status import UnfinishedRunError

    try:
        yield
    except EngineMissingError as error:
        raise click.UsageError(str(error)) from error
    except DesignError as error:
        raise click.UsageError(f"--over {error}") from error
    except UnsuitedConfigError as error:
        click.echo(f"{path}: {error}", err=True)
        raise click.exceptions.Exit(exit_codes.USAGE) from error
    except UnfinishedRunError as error:
        click.echo(f"{path}: {error}", err=True)
        raise click.exceptions.Exit(exit_codes.NOT_COMPLETED) from error
