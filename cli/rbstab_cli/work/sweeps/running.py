"""Running a sweep: progress, interrupts, the proofs afterwards, and the exit code."""

import os
import sys
from pathlib import Path
from threading import Event
from typing import NoReturn

import click

from rbstab.files.text import grouped, shell_word
from rbstab.report.model.words import listed
from rbstab.sweep.execution.computing import ExecutorError
from rbstab.sweep.folder.sweep_folder import resuming_command
from rbstab.sweep.options import SweepOptions
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.proofs.disturbed import keep_bounds
from rbstab.sweep.sweep import Sweep, sweep_to_folder
from rbstab_cli import exit_codes
from rbstab_cli.errors import Failed
from rbstab_cli.interrupts import graceful_interrupts, interrupted_code
from rbstab_cli.output.progress import working
from rbstab_cli.printing import hint, say
from rbstab_cli.work.sweeps.answers import prove_and_tell
from rbstab_cli.work.sweeps.progress import EventPrinter
from rbstab_cli.work.sweeps.tables import report_sweep

MAX_NAMED = 6
"""The largest number of ranges of members that a message lists."""

RESUME = "Run the same command again to resume."


def run_sweep(
    plan: Plan,
    folder: Path,
    options: SweepOptions,
    *,
    unlimited: bool | None,
    as_json: bool,
) -> int:
    """Run a sweep, print the results, and return the exit code.

    Args:
        plan: The plan.
        folder: The folder of the sweep.
        options: How to run it.
        unlimited: Whether the proofs after a finished sweep have no budget of time; None: nothing
            is proved. What is proved is printed after the results, or is part of the JSON.
        as_json: Whether to print JSON.
    """
    stop, interrupted = Event(), Event()
    try:
        with graceful_interrupts(stop, interrupted):
            with working("sweep") as work:
                printer = EventPrinter(interrupted, work)
                sweep = sweep_to_folder(plan, folder, options, printer, stop)
            if sweep.finished and (unlimited is not None or plan.prove is not None):
                with working("bounds on disturbances"):
                    keep_bounds(plan, folder.parent, unlimited=bool(unlimited))
            if not as_json:
                report_sweep(sweep, proofs_follow=unlimited is not None)
            _print_end(sweep, options, interrupted=interrupted.is_set())
        answers = None
        if unlimited is not None and sweep.finished and not interrupted.is_set():
            try:
                answers = prove_and_tell(plan, sweep, unlimited=unlimited)
            except KeyboardInterrupt:
                _exit_at_once("all members are stored, and the finished proofs")
        if as_json:
            report_sweep(sweep, as_json=True, proofs=None if answers is None else answers.data)
        elif answers is not None:
            for sentence in answers.sentences:
                click.echo(f"Convergence: {sentence}.")
        if answers is not None and answers.missing:
            say(
                f"Interrupted: all {grouped(sweep.folder.manifest.members)} members are stored in "
                f"{sweep.folder.sweep_file}; missing: {answers.missing}."
            )
            say(RESUME)
            return exit_codes.INTERRUPTED
        if sweep.finished:
            hint(f"Next: rbstab report {shell_word(sweep.folder.path)}")
    except KeyboardInterrupt:
        _exit_at_once("finished shards are stored")
    except ExecutorError as error:
        stored = f"Finished shards are stored. {RESUME}"
        raise Failed(exit_codes.STORAGE, f"error: {error}", stored) from error
    if sweep.finished or _is_done_part(sweep, options):
        # Status 0 counts the members that completed; a part may have no members.
        success = sweep.inventory.counts[0] or not sweep.inventory.members
        return exit_codes.OK if success else exit_codes.NOT_COMPLETED
    return exit_codes.INTERRUPTED if interrupted.is_set() else exit_codes.NOT_COMPLETED


def _exit_at_once(stored: str) -> NoReturn:
    say(f"Interrupted: {stored}. {RESUME}")
    sys.stdout.flush()
    sys.stderr.flush()
    # Do not wait for the threads that are still computing.
    os._exit(interrupted_code())


def _is_done_part(sweep: Sweep, options: SweepOptions) -> bool:
    """Whether the sweep is a part, has all its shards, and was not stopped by a failed member."""
    stopped = options.fail_fast and sweep.inventory.first_failed is not None
    return sweep.part is not None and not sweep.inventory.missing and not stopped


def _print_end(sweep: Sweep, options: SweepOptions, *, interrupted: bool) -> None:
    """Print how the sweep ended; if it did not finish, the next command."""
    stored, folder = _stored(sweep), sweep.folder
    missing = sweep.inventory.missing
    if sweep.finished:
        hint(f"-> {folder.sweep_file}")
    elif _is_done_part(sweep, options):
        hint(f"{stored} When all parts are done, run: {resuming_command(folder.path)}")
    elif interrupted:
        say(f"Interrupted: {stored}")
        say(RESUME)
    elif options.fail_fast:
        say(f"Stopped: member {sweep.inventory.first_failed} failed; {stored}")
        say("Run the same command without --fail-fast to resume.")
    elif missing:
        ranges = (f"{first} to {stop - 1}" for first, stop in folder.ranges(missing))
        which = f"members {listed(ranges, MAX_NAMED)}"
        say(f"{len(missing)} of {folder.shards} shards are missing: {which}")
        say(f"Run the missing shards: {resuming_command(folder.path)}")


def _stored(sweep: Sweep) -> str:
    """Return a sentence on what is stored: the members of a sweep, or the shards of a part."""
    if sweep.part is None:
        done, members = sweep.inventory.members, sweep.folder.manifest.members
        return f"{grouped(done)} of {grouped(members)} members are stored."
    stored = len(sweep.inventory.done)
    shards = stored + len(sweep.inventory.missing)
    return f"{stored} of {shards} shards of part {sweep.part} are stored."
