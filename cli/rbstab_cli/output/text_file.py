"""Write text files of commands."""

from pathlib import Path

import click

from rbstab_cli import exit_codes


def refuse_existing(path: Path, *, force: bool) -> None:
    """End the command with exit code 4 if the file exists and must not be replaced."""
    if path.exists() and not force:
        click.echo(f"{path}: already exists. Replace it with --force.", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE)


def write_text(path: Path, text: str, *, force: bool) -> None:
    """Write a whole file; on an error leave the old file and end the command with exit code 4."""
    from rbstab.store.atomic import write_atomically
    from rbstab.store.errors import StoreError

    refuse_existing(path, force=force)
    try:
        write_atomically(path, text.encode(), replace=force)
    except (OSError, StoreError) as error:
        reason = getattr(error, "strerror", None) or error
        click.echo(f"{path}: cannot be written: {reason}", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE) from error
