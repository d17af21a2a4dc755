"""Common code of the commands that run a sweep: progress, interrupts, exit codes."""

import os
import sys
from collections.abc import Callable
from threading import Event
from typing import TYPE_CHECKING, NoReturn

import click

from rbstab.files.counts import grouped
from rbstab_cli import exit_codes

if TYPE_CHECKING:
    from rbstab.sweep.sweep import Sweep
    from rbstab_cli.output.sweeps.sweep_answers import Answers
    from rbstab_cli.output.sweeps.sweep_progress import ProgressPrinter

SweepTask = Callable[["ProgressPrinter", Event], "Sweep"]
"""Runs a sweep. It calls the printer with each event, and stops once `Event` is set."""


def run_task(
    task: SweepTask,
    *,
    fail_fast: bool,
    as_json: bool,
    quiet: bool,
    after: "Callable[[Sweep], Answers] | None" = None,
) -> None:
    """Run a sweep, print the results, and end the command with its exit code.

    Args:
        task: Runs the sweep.
        fail_fast: Whether the task stops at the first member that failed.
        as_json: Whether to print JSON.
        quiet: Whether to leave out progress and hints.
        after: Proves what it can of a finished sweep, when its results are stored. What it found is
            printed after the results, or is part of the JSON.
    """
    from rbstab.sweep.execution.computing import ExecutorError
    from rbstab_cli.interrupts import graceful_interrupts
    from rbstab_cli.output.sweeps.sweep_progress import progress_printer
    from rbstab_cli.output.sweeps.sweep_report import report_sweep

    stop, interrupted = Event(), Event()
    try:
        with graceful_interrupts(stop, interrupted):
            with progress_printer(interrupted, quiet=quiet) as on_event:
                sweep = task(on_event, stop)
            if not as_json:
                report_sweep(sweep, proofs_follow=after is not None)
            _print_end(sweep, fail_fast=fail_fast, interrupted=interrupted.is_set(), quiet=quiet)
        proving = after is not None and sweep.finished and not interrupted.is_set()
        try:
            answers = after(sweep) if after is not None and proving else None
        except KeyboardInterrupt:
            _exit_at_once("all members are stored, and the finished proofs")
        if as_json:
            report_sweep(sweep, as_json=True, answers=answers)
        elif answers is not None:
            for sentence in answers.sentences:
                click.echo(f"Convergence: {sentence}.")
        if answers is not None and answers.missing:
            _exit_without_proofs(sweep, answers.missing)
        if sweep.finished and not quiet:
            click.echo(f"Next: rbstab report {_folder_word(sweep)}", err=True)
    except KeyboardInterrupt:
        _exit_at_once("finished shards are stored")
    except ExecutorError as error:
        click.echo(f"error: {error}", err=True)
        click.echo("Finished shards are stored. Run the same command again to resume.", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE) from error
    code = _exit_code(sweep, fail_fast=fail_fast, interrupted=interrupted.is_set())
    raise click.exceptions.Exit(code)


def _exit_without_proofs(sweep: "Sweep", missing: str) -> NoReturn:
    """End the command after an interrupt of its proofs: all results are stored."""
    click.echo(
        f"Interrupted: all {grouped(sweep.folder.manifest.members)} members are stored in "
        f"{sweep.folder.sweep_file}; missing: {missing}.",
        err=True,
    )
    click.echo("Run the same command again to resume.", err=True)
    raise click.exceptions.Exit(exit_codes.INTERRUPTED)


def _exit_at_once(stored: str) -> NoReturn:
    from rbstab_cli.interrupts import interrupted_code

    click.echo(f"Interrupted: {stored}. Run the same command again to resume.", err=True)
    sys.stdout.flush()
    sys.stderr.flush()
    # Do not wait for the threads that are still computing.
    os._exit(interrupted_code())


def _is_done_part(sweep: "Sweep", *, fail_fast: bool) -> bool:
    """Whether the sweep is a part, has all its shards, and was not stopped by a failed member."""
    stopped = fail_fast and sweep.inventory.first_failed is not None
    return sweep.part is not None and not sweep.inventory.missing and not stopped


def _exit_code(sweep: "Sweep", *, fail_fast: bool, interrupted: bool) -> int:
    if sweep.finished or _is_done_part(sweep, fail_fast=fail_fast):
        # Status 0 counts the members that completed; a part may have no members.
        success = sweep.inventory.counts[0] or not sweep.inventory.members
        return exit_codes.OK if success else exit_codes.NOT_COMPLETED
    return exit_codes.INTERRUPTED if interrupted else exit_codes.NOT_COMPLETED


def _print_end(sweep: "Sweep", *, fail_fast: bool, interrupted: bool, quiet: bool) -> None:
    """Print how the sweep ended; if it did not finish, the next command."""
    members = grouped(sweep.folder.manifest.members)
    stored = f"{grouped(sweep.inventory.members)} of {members} members are stored."
    if sweep.finished:
        if not quiet:
            click.echo(f"-> {sweep.folder.sweep_file}", err=True)
    elif _is_done_part(sweep, fail_fast=fail_fast):
        if not quiet:
            click.echo(_part_done(sweep), err=True)
    elif interrupted:
        click.echo(f"Interrupted: {_stored_of_part(sweep) or stored}", err=True)
        click.echo("Run the same command again to resume.", err=True)
    elif fail_fast:
        first = sweep.inventory.first_failed
        click.echo(f"Stopped: member {first} failed; {_stored_of_part(sweep) or stored}", err=True)
        click.echo("Run the same command without --fail-fast to resume.", err=True)
    elif sweep.inventory.missing:
        _print_missing(sweep)


def _stored_of_part(sweep: "Sweep") -> str:
    """Return a sentence on the stored shards of a part; the empty string for a whole sweep."""
    if sweep.part is None:
        return ""
    stored = len(sweep.inventory.done)
    shards = stored + len(sweep.inventory.missing)
    return f"{stored} of {shards} shards of part {sweep.part} are stored."


def _part_done(sweep: "Sweep") -> str:
    from rbstab.sweep.folder.sweep_folder import resuming_command

    command = resuming_command(sweep.folder.path)
    return f"{_stored_of_part(sweep)} When all parts are done, run: {command}"


def _folder_word(sweep: "Sweep") -> str:
    from rbstab.files.shell_words import shell_word

    return shell_word(sweep.folder.path)


MAX_NAMED = 6
"""The largest number of ranges of members that a message lists."""


def _print_missing(sweep: "Sweep") -> None:
    """Print which shards are missing, and the command that computes them."""
    from rbstab.sweep.folder.sweep_folder import resuming_command

    missing = sweep.inventory.missing
    ranges = [f"{first} to {stop - 1}" for first, stop in sweep.folder.ranges(missing)]
    click.echo(
        f"{len(missing)} of {sweep.folder.shards} shards are missing: members {_listed(ranges)}",
        err=True,
    )
    click.echo(f"Run the missing shards: {resuming_command(sweep.folder.path)}", err=True)


def _listed(names: list[str]) -> str:
    """Join names with commas; give only the number of those after `MAX_NAMED`."""
    more = f" and {len(names) - MAX_NAMED} more" if len(names) > MAX_NAMED else ""
    return ", ".join(names[:MAX_NAMED]) + more
