"""Write several new files into a folder; a file that exists is never overwritten."""

from collections.abc import Mapping
from pathlib import Path

import click

from rbstab_cli import exit_codes


def write_new_files(
    folder: Path, contents: Mapping[str, str | bytes], *, elsewhere: str, keep_equal: bool = False
) -> None:
    """Write files and print their paths; if any of them cannot be written, none is.

    All problems are printed, and end the command with exit code 4.

    Args:
        folder: The folder; it is made if it is missing.
        contents: The contents by paths below the folder.
        elsewhere: The command that writes them into another folder, printed after the problems.
        keep_equal: Whether a file that has this content already is left as it is; otherwise it is a
            problem, like any file that exists.
    """
    from rbstab.store.disk.atomic import write_atomically
    from rbstab.store.errors import StoreError

    wanted = {folder / name: _as_bytes(content) for name, content in contents.items()}
    kept = {path for path, content in wanted.items() if keep_equal and _holds(path, content)}
    problems = [problem for path in wanted if path not in kept for problem in _problems(path)]
    if problems:
        problems.append(f"Nothing was written. Choose another folder: {elsewhere}")
    _fail(problems)
    for path, content in wanted.items():
        if path in kept:
            click.echo(f"{path} is there already", err=True)
            continue
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_atomically(path, content, replace=False)
        except (OSError, StoreError) as error:
            _fail([f"{path}: cannot be written: {getattr(error, 'strerror', None) or error}"])
        click.echo(f"-> {path}", err=True)


def _as_bytes(content: str | bytes) -> bytes:
    return content if isinstance(content, bytes) else content.encode()


def _holds(path: Path, content: bytes) -> bool:
    from rbstab.store.disk.paths import read_regular
    from rbstab.store.errors import StoreError

    try:
        return read_regular(path) == content
    except StoreError:
        return False


def _problems(path: Path) -> list[str]:
    from rbstab.store.disk.paths import check_folder, check_writable, path_exists
    from rbstab.store.errors import StoreError

    try:
        if path_exists(path):
            return [f"{path}: already exists; it is not overwritten"]
        check_writable(path)
        check_folder(path.parent)
    except StoreError as error:
        return [f"error: {error}"]
    return []


def _fail(problems: list[str]) -> None:
    for problem in problems:
        click.echo(problem, err=True)
    if problems:
        raise click.exceptions.Exit(exit_codes.STORAGE)
