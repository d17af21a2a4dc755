"""A report into a file of any format, whole or not at all."""

from io import StringIO
from pathlib import Path

from rbstab.report.model.document import Report
from rbstab.report.writers.signature import SIGNATURES, is_report
from rbstab.store.atomic import write_atomically
from rbstab.store.errors import ResultExistsError, StoreError

SUFFIXES = {
    ".html": "html",
    ".htm": "html",
    ".md": "md",
    ".markdown": "md",
    ".pdf": "pdf",
    ".txt": "text",
}
"""The format of a report by the name of its file."""

TEXT_WIDTH = 100
"""Columns of a report that is text in a file."""


def write_report(report: Report, path: Path, form: str, *, force: bool = False) -> None:
    """Writes a report; an older report of that name gives way.

    Args:
        report: The report.
        path: The file. Missing folders are made. Pictures of a report in Markdown stand in the
            folder `NAME_files` beside it.
        form: The format, a value of `SUFFIXES`.
        force: Whether a file that is no report gives way, too.

    Raises:
        ResultExistsError: The file exists and is no report (without `force`).
        StoreError: The operating system refused.
    """
    check_replaceable(path, force=force)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _WRITERS[form](report, path)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise StoreError(f"{path} cannot be written: {reason}") from error


def check_replaceable(path: Path, *, force: bool) -> None:
    """Refuses a name under which something else stands than a report.

    Raises:
        ResultExistsError: So it is.
        StoreError: It is a folder, or cannot be read.
    """
    try:
        if path.is_dir():
            raise StoreError(f"{path} cannot be written: it is a folder")
        if path.exists() and not force and not is_report(path):
            raise ResultExistsError(f"{path} exists already and is no report; --force replaces it")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise StoreError(f"{path} cannot be read: {reason}") from error


def _write_html(report: Report, path: Path) -> None:
    # Each format is imported late: it brings a library that the others do not need.
    from rbstab.report.writers.html import page

    write_atomically(path, page(report).encode() + SIGNATURES["html"], replace=True)


def _write_markdown(report: Report, path: Path) -> None:
    from rbstab.report.writers.markdown import write_markdown

    write_markdown(report, path)


def _write_pdf(report: Report, path: Path) -> None:
    from rbstab.report.writers.pdf import pdf_of

    write_atomically(path, pdf_of(report) + SIGNATURES["pdf"], replace=True)


def _write_text(report: Report, path: Path) -> None:
    from rich.console import Console

    from rbstab.report.writers.text import print_report

    text = StringIO()
    console = Console(file=text, width=TEXT_WIDTH, highlight=False, color_system=None)
    print_report(report, console)
    lines = [line.rstrip() for line in text.getvalue().splitlines()]
    write_atomically(path, "\n".join([*lines, ""]).encode() + SIGNATURES["text"], replace=True)


_WRITERS = {"html": _write_html, "md": _write_markdown, "pdf": _write_pdf, "text": _write_text}
