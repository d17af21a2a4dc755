"""What a command prints, in a file instead."""

from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from io import StringIO
from pathlib import Path

from rbstab_cli.output.text_file import write_text


@contextmanager
def printed_to(path: Path | None, *, force: bool) -> Iterator[None]:
    """Lets what is printed inside appear in a file (`write_text`); on stdout if path is None."""
    if path is None:
        yield
        return
    text = StringIO()
    with redirect_stdout(text):
        yield
    write_text(path, text.getvalue(), force=force)
