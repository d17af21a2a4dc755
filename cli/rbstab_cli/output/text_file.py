"""Write text files of commands."""

from pathlib import Path
from typing import NoReturn

import click

from rbstab_cli import exit_codes


def check_target(path: Path, *, force: bool) -> None:
    """End the command with exit code 4, before its work, if a file cannot be written.

    Args:
        path: The file.
        force: Whether an existing file is replaced; a folder, a pipe or a device never is.
    """
    from rbstab.store.disk.paths import check_writable, path_exists
    from rbstab.store.errors import StoreError

    try:
        check_writable(path)
        if path_exists(path) and not force:
            _fail(f"{path}: already exists. Replace it with --force.")
        if not path_exists(path.parent):
            _fail(f"{path}: cannot be written: the folder {path.parent} does not exist")
    except StoreError as error:
        _fail(f"error: {error}")


def write_text(path: Path, text: str, *, force: bool) -> None:
    """Write a whole file; on an error leave the old file and end the command with exit code 4.

    Args:
        path: The file.
        text: Its new text.
        force: As `check_target`.
    """
    from rbstab.files.names import readable_name
    from rbstab.store.disk.atomic import write_atomically
    from rbstab.store.errors import StoreError

    check_target(path, force=force)
    # The name of a file in the text may have bytes that are not UTF-8.
    content = readable_name(text).encode(errors="backslashreplace")
    try:
        write_atomically(path, content, replace=force)
    except (OSError, StoreError) as error:
        reason = getattr(error, "strerror", None) or error
        _fail(f"{path}: cannot be written: {reason}")


def _fail(message: str) -> NoReturn:
    click.echo(message, err=True)
    raise click.exceptions.Exit(exit_codes.STORAGE)
