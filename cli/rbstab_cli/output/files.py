"""Files that commands write: each is checked before the work, and appears when it is complete."""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from io import StringIO
from pathlib import Path

import click

from rbstab.experiment.proof_cache import PROOFS
from rbstab.files.text import readable_name
from rbstab.store.disk.atomic import write_atomically
from rbstab.store.disk.paths import check_folder, check_writable, path_exists, read_regular
from rbstab.store.errors import StoreError
from rbstab_cli import exit_codes
from rbstab_cli.errors import Failed, reason_of, require
from rbstab_cli.printing import say


def check_target(path: Path, *, force: bool) -> None:
    """End the command with exit code 4, before its work, if a file cannot be written.

    Args:
        path: The file.
        force: Whether an existing file is replaced; a folder, a pipe or a device never is.
    """
    check_writable(path)
    if path_exists(path) and not force:
        raise Failed(exit_codes.STORAGE, f"{path}: already exists. Replace it with --force.")
    if not path_exists(path.parent):
        reason = f"the folder {path.parent} does not exist"
        raise Failed(exit_codes.STORAGE, f"{path}: cannot be written: {reason}")


def write_file(path: Path, content: str | bytes, *, force: bool) -> None:
    """Write a whole file; on an error leave the old file and end the command with exit code 4.

    Args:
        path: The file.
        content: Its new content.
        force: As `check_target`.
    """
    check_target(path, force=force)
    if isinstance(content, str):
        # The name of a file in the text may have bytes that are not UTF-8.
        content = readable_name(content).encode(errors="backslashreplace")
    try:
        write_atomically(path, content, replace=force)
    except (OSError, StoreError) as error:
        reason = f"{path}: cannot be written: {reason_of(error)}"
        raise Failed(exit_codes.STORAGE, reason) from error


def new_config(config: Path, output: Path | None, ending: str, *, force: bool) -> Path:
    """Return the file of a config that is made from a given one; it can be written.

    Args:
        config: The given config.
        output: What the user named; None for the name of the given config with an ending.
        ending: The ending: `_tuned`.
        force: As `check_target`.

    Raises:
        UsageError: It is the given config.
    """
    target = output or Path(f"{config.stem}{ending}.yaml")
    if target.resolve() == config.resolve():
        raise click.UsageError(f"{target} is the given config. Choose another file with -o.")
    check_target(target, force=force)
    return target


def form_of(path: Path, forms: Iterable[str], option: str = "-o") -> str:
    """Return the form of a file that is to be written, by its ending.

    Args:
        path: The file.
        forms: The endings that are allowed, without their dots.
        option: The option that names the file, for the error.

    Raises:
        UsageError: It is none of the forms.
    """
    ending = path.suffix.lower().removeprefix(".")
    if ending not in forms:
        endings = ", ".join(f".{form}" for form in forms)
        raise click.UsageError(f"{option} {path}: expected a file name that ends in {endings}")
    return ending


def figure_form(option: str, path: Path, *, force: bool) -> str:
    """Return the form of a figure by the name of its file; it can be drawn, and written.

    Args:
        option: The option that names the file, for the errors.
        path: The file.
        force: As `check_target`.

    Raises:
        UsageError: It is no form of figures, or a package is missing.
    """
    from rbstab.report.writers.figure_files import FORMS  # imported late: few commands draw

    form = form_of(path, FORMS, option)
    if form != "csv":
        require("report", f"{option} {path}", "vl_convert")
    check_target(path, force=force)
    return form


@contextmanager
def stdout_to_file(path: Path | None, *, force: bool) -> Iterator[None]:
    """Write the output of the block to a file with `write_file`; to stdout if path is None."""
    if path is None:
        yield
        return
    text = StringIO()
    with redirect_stdout(text):
        yield
    write_file(path, text.getvalue(), force=force)


def write_new_files(
    folder: Path, contents: Mapping[str, bytes], *, elsewhere: str, keep_equal: bool = False
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
    wanted = {folder / name: content for name, content in contents.items()}
    kept = {path for path, content in wanted.items() if keep_equal and _holds(path, content)}
    problems = [problem for path in wanted if path not in kept for problem in _problems(path)]
    if problems:
        way = f"Nothing was written. Choose another folder: {elsewhere}"
        raise Failed(exit_codes.STORAGE, *problems, way)
    for path, content in wanted.items():
        if path in kept:
            say(f"{path} is there already")
            continue
        path.parent.mkdir(parents=True, exist_ok=True)
        write_file(path, content, force=False)
        say(f"-> {path}")


def _holds(path: Path, content: bytes) -> bool:
    try:
        return read_regular(path) == content
    except StoreError:
        return False


def _problems(path: Path) -> list[str]:
    """Return why a new file cannot be written; none if it can."""
    try:
        if path_exists(path):
            return [f"{path}: already exists; it is not overwritten"]
        check_writable(path)
        check_folder(path.parent)
    except StoreError as error:
        return [f"error: {error}"]
    return []


def check_results_folder(folder: Path, results: Iterable[Path], *, force: bool = False) -> bool:
    """End the command with exit code 4 if nothing can be stored in the folder of its results.

    A folder that has all results is not tried: stored results are read from folders that nobody can
    write.

    Args:
        folder: The folder; it need not exist.
        results: The files or folders of the results.
        force: Whether all results are written again, so that the folder is always tried.

    Returns:
        Whether the folder was tried.
    """
    try:
        if not force and all(map(path_exists, results)):
            return False
        check_folder(folder)
    except StoreError as error:
        raise _nothing_run(error, "-o names another folder") from error
    return True


def check_proofs_folder(folder: Path) -> None:
    """End the command with exit code 4 if no proof can be stored in a folder of results."""
    try:
        check_folder(folder / PROOFS)
    except StoreError as error:
        way = "-o names another folder, --no-prove makes no proofs"
        raise _nothing_run(error, way) from error


def _nothing_run(error: StoreError, way: str) -> Failed:
    return Failed(exit_codes.STORAGE, f"error: {error}. Nothing was run; {way}.")
