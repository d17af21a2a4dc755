"""`rbstab gather`."""

from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING

import click

from rbstab_cli import exit_codes
from rbstab_cli.arguments.options import ALLOW_PYTHON, AS_JSON, QUIET

if TYPE_CHECKING:
    from rbstab.sweep.sweep import Sweep
    from rbstab_cli.output.sweeps.sweep_progress import ProgressPrinter
    from rbstab_cli.sweep_run import SweepTask


@click.command("gather")
@click.argument("folder", metavar="DIR", type=click.Path(file_okay=False, path_type=Path))
@ALLOW_PYTHON
@AS_JSON
@QUIET
def command(folder: Path, allow_python: bool, as_json: bool, quiet: bool) -> None:
    """Gather the shards of a sweep into one file.

    DIR is the folder of a sweep, for example of one computed in parts (see docs/cluster.md). The
    command computes members only for the comparison with scipy. If shards are missing, it lists
    them and ends with exit code 3.
    """
    from rbstab.config.user_code.permission import CodeNotAllowedError
    from rbstab.integrate.engines import EngineMissingError
    from rbstab.store.errors import StoreError
    from rbstab_cli.sweep_run import run_task

    try:
        task = _gather_task(folder, allow_python=allow_python, quiet=quiet)
        run_task(task, fail_fast=False, as_json=as_json, quiet=quiet)
    except StoreError as error:
        # Most messages begin with the folder.
        about = "" if str(error).startswith(str(folder)) else f"{folder}: "
        click.echo(f"{about}{error}", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE) from error
    except (CodeNotAllowedError, EngineMissingError) as error:
        raise click.UsageError(str(error)) from error


def _gather_task(folder: Path, *, allow_python: bool, quiet: bool) -> "SweepTask":
    from rbstab.sweep.execution.events import Gathering, SweepEvent
    from rbstab.sweep.sweep import gather_folder

    def task(on_event: "ProgressPrinter", stop: Event) -> "Sweep":
        gathered_now = False

        def on_gather_event(event: SweepEvent | None) -> None:
            nonlocal gathered_now
            gathered_now = gathered_now or isinstance(event, Gathering)
            on_event(event)

        sweep = gather_folder(folder, on_gather_event, stop, allow_python=allow_python)
        if sweep.finished and not gathered_now and not quiet:
            click.echo(f"{folder} is already gathered", err=True)
        return sweep

    return task
