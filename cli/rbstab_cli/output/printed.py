"""Redirection of a command's standard output to a file."""

from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from io import StringIO
from pathlib import Path

from rbstab_cli.output.text_file import write_text


@contextmanager
def stdout_to_file(path: Path | None, *, force: bool) -> Iterator[None]:
    """Write the output of the block to a file with `write_text`; to stdout if path is None."""
    if path is None:
        yield
        return
    text = StringIO()
    with redirect_stdout(text):
        yield
    write_text(path, text.getvalue(), force=force)
