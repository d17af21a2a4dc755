"""Write a report to a file in any format, atomically: an error leaves the old file as it was."""

from importlib.util import find_spec
from io import StringIO
from pathlib import Path

from rbstab.files.paths import exists
from rbstab.report.model.document import Report
from rbstab.report.writers.signature import SIGNATURES, is_report, pictures_folder
from rbstab.store.disk.atomic import write_atomically
from rbstab.store.disk.paths import check_writable
from rbstab.store.errors import ResultExistsError, StoreError

SUFFIXES = {
    ".html": "html",
    ".htm": "html",
    ".md": "md",
    ".markdown": "md",
    ".pdf": "pdf",
    ".txt": "text",
}
"""The format of a report by the suffix of its file."""

PACKAGES = {
    "html": {},
    "md": {"vl_convert": "vl-convert-python"},
    "pdf": {"vl_convert": "vl-convert-python", "typst": "typst"},
    "text": {},
}
"""The packages of each format that a plain install lacks: the module and the name to install."""

TEXT_WIDTH = 100
"""Characters per line of a report written as text to a file."""


class FormatUnavailableError(Exception):
    """A package that the format of a report needs is not installed."""


def check_available(form: str) -> None:
    """Check that the packages of a format are installed; none is imported.

    Raises:
        FormatUnavailableError: One is missing.
    """
    missing = [name for module, name in PACKAGES[form].items() if find_spec(module) is None]
    if missing:
        raise FormatUnavailableError(
            f"the format {form} needs {' and '.join(missing)}, which a plain install lacks. "
            'Run `pip install "rbstab[report]"`, or use --format html.'
        )


def write_report(report: Report, path: Path, form: str, *, force: bool = False) -> None:
    """Write a report; it replaces an older report of that name.

    Args:
        report: The report.
        path: The file. Missing folders are created. Markdown has its pictures in the folder
            `NAME_files` beside it.
        form: The format, a value of `SUFFIXES`.
        force: Whether to replace a file that is not a report.

    Raises:
        FormatUnavailableError: A package that the format needs is not installed.
        ResultExistsError: The file exists and is not a report (without `force`).
        StoreError: The operating system raised an error.
    """
    check_available(form)
    check_target(path, form, force=force)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _write(report, path, form)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise StoreError(f"{path} cannot be written: {reason}") from error


def check_target(path: Path, form: str, *, force: bool) -> None:
    """Check that a report may be written to a path, so that an error comes before the work.

    Args:
        path: The file.
        form: The format, a value of `SUFFIXES`.
        force: Whether to replace a file that is not a report.

    Raises:
        ResultExistsError: A file that is not a report has that path (without `force`).
        StoreError: The path cannot be written or read, or is not a file.
    """
    check_writable(path)
    try:
        if exists(path) and not force and not is_report(path):
            raise ResultExistsError(
                f"{path} already exists and is not a report. Use --force to replace it."
            )
    except OSError as error:
        raise StoreError(f"{path} cannot be read: {error.strerror or error}") from error
    if form == "md":
        check_writable(pictures_folder(path) / "picture.png")


def _write(report: Report, path: Path, form: str) -> None:
    # Each format is imported late: it needs a library that the others do not.
    if form == "md":
        from rbstab.report.writers.markdown import write_markdown

        write_markdown(report, path)
        return
    if form == "html":
        from rbstab.report.writers.html import page

        content = page(report).encode()
    elif form == "pdf":
        from rbstab.report.writers.pdf import pdf_of

        content = pdf_of(report)
    else:
        from rich.console import Console

        from rbstab.report.writers.text import print_report

        text = StringIO()
        console = Console(file=text, width=TEXT_WIDTH, highlight=False, color_system=None)
        print_report(report, console)
        content = "".join(f"{line.rstrip()}\n" for line in text.getvalue().splitlines()).encode()
    write_atomically(path, content + SIGNATURES[form], replace=True)
