"""The course of a sweep on the command line: progress, interrupts, and the words at its end."""

import os
import sys
from collections.abc import Callable
from threading import Event
from typing import TYPE_CHECKING

import click

from rbstab_cli import exit_codes

if TYPE_CHECKING:
    from rbstab.sweep.sweep import Sweep
    from rbstab_cli.output.sweep_progress import ProgressPrinter

Doing = Callable[["ProgressPrinter", Event], "Sweep"]
"""Does a sweep: tells what happens, and ends early where the event is set."""


def carry_out(do: Doing, *, fail_fast: bool, as_json: bool, quiet: bool) -> None:
    """Does a sweep and ends the command with its exit code.

    Args:
        do: Does it.
        fail_fast: Whether it stops at the first member that failed.
        as_json: Whether to print JSON.
        quiet: Whether to say only what is wrong.
    """
    from rbstab.sweep.execution.work_queue import ExecutorError
    from rbstab_cli.interrupts import ending_in_order
    from rbstab_cli.output.sweep_progress import progress_printer
    from rbstab_cli.output.sweep_report import report_sweep

    stop, interrupted = Event(), Event()
    try:
        with ending_in_order(stop, interrupted):
            with progress_printer(interrupted, quiet=quiet) as on_event:
                done = do(on_event, stop)
            report_sweep(done, as_json=as_json)
            _say_end(done, fail_fast=fail_fast, interrupted=interrupted.is_set(), quiet=quiet)
    except KeyboardInterrupt:
        _end_at_once()
    except ExecutorError as error:
        click.echo(f"error: {error}", err=True)
        click.echo("Finished shards are stored. The same command goes on from there.", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE) from error
    code = _exit_code(done, fail_fast=fail_fast, interrupted=interrupted.is_set())
    raise click.exceptions.Exit(code)


def _end_at_once() -> None:
    click.echo("Interrupted; finished shards are stored. The same command goes on.", err=True)
    sys.stdout.flush()
    sys.stderr.flush()
    # Threads are still computing, and are not waited for.
    os._exit(exit_codes.INTERRUPTED)


def _is_done_part(done: "Sweep", *, fail_fast: bool) -> bool:
    """Whether it is a part of which nothing is left, and nothing was to stop it."""
    stopped = fail_fast and done.inventory.first_failed is not None
    return done.part is not None and not done.inventory.missing and not stopped


def _exit_code(done: "Sweep", *, fail_fast: bool, interrupted: bool) -> int:
    if done.finished or _is_done_part(done, fail_fast=fail_fast):
        # The first status is that of a member that completed; a part may have no members.
        found = done.inventory.counts[0] or not done.inventory.members
        return exit_codes.OK if found else exit_codes.NOT_COMPLETED
    return exit_codes.INTERRUPTED if interrupted else exit_codes.NOT_COMPLETED


def _say_end(done: "Sweep", *, fail_fast: bool, interrupted: bool, quiet: bool) -> None:
    """How it ended, and what comes next."""
    stored = f"{done.inventory.members} of {done.folder.manifest.members} members are stored."
    if done.finished:
        if not quiet:
            click.echo(f"-> {done.folder.sweep_file}", err=True)
    elif _is_done_part(done, fail_fast=fail_fast):
        if not quiet:
            click.echo(_part_done(done), err=True)
    elif interrupted:
        click.echo(f"Interrupted: {_of_part(done) or stored}", err=True)
        click.echo("The same command goes on from there.", err=True)
    elif fail_fast:
        first = done.inventory.first_failed
        click.echo(f"Stopped: member {first} failed; {_of_part(done) or stored}", err=True)
        click.echo("Without --fail-fast the same command goes on from there.", err=True)
    elif done.inventory.missing:
        _say_missing(done)


def _of_part(done: "Sweep") -> str:
    """How many shards of its part are done; nothing where it is no part."""
    if done.part is None:
        return ""
    shards = len(done.inventory.done)
    return (
        f"{shards} of {shards + len(done.inventory.missing)} shards of part {done.part} are stored."
    )


def _part_done(done: "Sweep") -> str:
    path = done.folder.path
    return f"{_of_part(done)} When all parts are there: rbstab gather {path}"


MAX_NAMED = 6
"""Ranges of members, or parts, that are named in one line."""


def _say_missing(done: "Sweep") -> None:
    """What keeps shards from being gathered, and what to do."""
    from rbstab.sweep.folder.parts import parts_missing

    missing = done.inventory.missing
    ranges = [f"{first} to {stop - 1}" for first, stop in done.folder.ranges(missing)]
    parts = list(map(str, parts_missing(done.folder.path, missing)))
    of_parts = f", of part {_some(parts)}" if parts else ""
    click.echo(
        f"{len(missing)} of {done.folder.shards} shards are missing{of_parts}: "
        f"members {_some(ranges)}",
        err=True,
    )
    option = f" --shard {parts[0]}, and so on" if parts else ""
    click.echo(
        f"The command that began the sweep computes them: rbstab sweep PLAN{option}", err=True
    )


def _some(names: list[str]) -> str:
    more = f" and {len(names) - MAX_NAMED} more" if len(names) > MAX_NAMED else ""
    return ", ".join(names[:MAX_NAMED]) + more
