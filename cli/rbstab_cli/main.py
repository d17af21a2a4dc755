"""The program `rbstab`: its command line, its streams, and the exit code of the process."""

import gc
import sys
from contextlib import suppress

import click

from rbstab_cli import exit_codes
from rbstab_cli.errors import reason_of
from rbstab_cli.interrupts import handle_interrupts, interrupted_code, stop_handling
from rbstab_cli.printing import say
from rbstab_cli.registry import FIRST_STEPS, Registry
from rbstab_cli.streams import ReaderGoneError, discard_output, flush_streams, prepare_streams


@click.group(
    cls=Registry, epilog=FIRST_STEPS, context_settings={"help_option_names": ["-h", "--help"]}
)
@click.version_option(
    package_name="rbstab",
    prog_name="rbstab",
    message="%(prog)s %(version)s",
    help="Show the version and exit.",
)
def cli() -> None:
    """Dynamics and Lyapunov stability of one rigid body: free, held at a point, or tied to it.

    Exit codes: 0 done; 1 an error in rbstab itself; 2 wrong config or command line; 3 a run did not
    complete, or nothing was found; 4 a result could not be written or read, or a proof was refused;
    5 the check of a proof takes too long; 130 interrupted (Ctrl-C); 141 the reader of a pipe ended,
    as in `rbstab show RESULT | head`; 143 terminated (SIGTERM).
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
    # The process ends: a last search of all objects for garbage would take up to 0.03 s.
    gc.freeze()
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
        where = "the output cannot be written" if error.filename is None else error.filename
        with suppress(OSError):
            say(f"error: {where}: {reason_of(error)}")
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
        say("Interrupted.")
        code = exit_codes.INTERRUPTED
    if code == exit_codes.INTERRUPTED:
        code = interrupted_code()
    return code if isinstance(code, int) else exit_codes.OK
