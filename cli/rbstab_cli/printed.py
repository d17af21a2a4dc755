"""What a command prints, in a file instead."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from io import StringIO
from pathlib import Path

import click

from rbstab_cli import exit_codes


@contextmanager
def printed_to(path: Path | None) -> Iterator[None]:
    """Lets what is printed inside appear in a file, whole or not at all; on stdout if path is None.

    An existing file ends the command with exit code 4, and so does one that cannot be written.
    """
    if path is None:
        yield
        return
    from rbstab.store.atomic import write_whole
    from rbstab.store.errors import StoreError

    text = StringIO()
    with redirect_stdout(text):
        yield
    try:
        write_whole(path, text.getvalue().encode())
    except (StoreError, OSError) as error:
        reason = getattr(error, "strerror", None)
        click.echo(f"error: {f'{path}: {reason}' if reason else error}", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE) from error
    sys.stdout.flush()
