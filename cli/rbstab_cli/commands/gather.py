"""`rbstab gather`."""

from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING

import click

from rbstab_cli import exit_codes

if TYPE_CHECKING:
    from rbstab.sweep.sweep import Sweep
    from rbstab_cli.output.sweep_progress import ProgressPrinter
    from rbstab_cli.sweep_run import Doing


@click.command("gather")
@click.argument("folder", metavar="DIR", type=click.Path(file_okay=False, path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print what was found as JSON.")
@click.option(
    "-q", "--quiet", is_flag=True, help="No progress and no advice; errors are still said."
)
def command(folder: Path, as_json: bool, quiet: bool) -> None:
    """Join the shards of a sweep that were computed in parts.

    DIR is the folder of any sweep (see docs/cluster.md). Nothing is computed but the comparison
    with scipy. If shards are missing, it is said which, and the exit code is 3.
    """
    from rbstab.integrate.engines import EngineMissingError
    from rbstab.store.errors import StoreError
    from rbstab_cli.sweep_run import carry_out

    try:
        carry_out(_gathering(folder, quiet=quiet), fail_fast=False, as_json=as_json, quiet=quiet)
    except StoreError as error:
        click.echo(f"{folder}: {error}", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE) from error
    except EngineMissingError as error:
        raise click.UsageError(str(error)) from error


def _gathering(folder: Path, *, quiet: bool) -> "Doing":
    from rbstab.sweep.execution.events import Gathering, SweepEvent
    from rbstab.sweep.sweep import gather_folder

    def gathering(on_event: "ProgressPrinter", stop: Event) -> "Sweep":
        anew = False

        def noticed(event: SweepEvent | None) -> None:
            nonlocal anew
            anew = anew or isinstance(event, Gathering)
            on_event(event)

        done = gather_folder(folder, noticed, stop)
        if done.finished and not anew and not quiet:
            click.echo(f"{folder} is gathered already", err=True)
        return done

    return gathering
