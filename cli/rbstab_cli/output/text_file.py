"""Text files that a command writes for people and other programs."""

from pathlib import Path

import click

from rbstab_cli import exit_codes


def refuse_taken(path: Path, *, force: bool) -> None:
    """Ends the command with exit code 4 where a file is there that may not be replaced."""
    if path.exists() and not force:
        click.echo(f"{path}: exists already; --force replaces it", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE)


def write_text(path: Path, text: str, *, force: bool) -> None:
    """Writes a file as a whole; ends the command with exit code 4 where that fails."""
    from rbstab.store.atomic import write_atomically
    from rbstab.store.errors import StoreError

    refuse_taken(path, force=force)
    try:
        write_atomically(path, text.encode(), replace=force)
    except (OSError, StoreError) as error:
        reason = getattr(error, "strerror", None) or error
        click.echo(f"{path}: cannot be written: {reason}", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE) from error
