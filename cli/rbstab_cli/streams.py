"""The standard streams of the process: closed, behind a closed pipe, or without some characters."""

import codecs
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import TextIOWrapper
from pathlib import Path

NAME_BYTES = "rbstab-name-bytes"
"""The error handler that prints the bytes of names which Python could not decode."""


class ReaderGoneError(Exception):
    """The program that reads the output has ended, as `head` does after its lines."""


@contextmanager
def reader_gone_errors() -> Iterator[None]:
    """Turn the error of a closed pipe into a `ReaderGoneError`, which click does not catch."""
    try:
        yield
    except BrokenPipeError as error:
        raise ReaderGoneError from error


def prepare_streams() -> None:
    """Make the standard streams usable, whatever the process was started with.

    A stream that is closed becomes the null device. A character that the encoding of a stream lacks
    is printed as its escape, U+03B8 as `u03b8` after a backslash, so that no output fails.

    A stream of ASCII becomes UTF-8. In the C locale without Python's UTF-8 mode, Python reads the
    bytes of a name above 127 as lone surrogates. They are printed as the bytes that they were, so
    a name is printed as it is.
    """
    codecs.register_error(NAME_BYTES, _name_bytes)
    # In the order of their numbers, so that each one gets the number of its stream.
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        stream = getattr(sys, name)
        if stream is None:
            stream = Path(os.devnull).open(mode, encoding="utf-8")  # noqa: SIM115 (it stays open)
            setattr(sys, name, stream)
        if mode == "w" and isinstance(stream, TextIOWrapper):
            if _is_ascii(stream):
                # click prints UTF-8 on such a stream anyway, but names with question marks.
                stream.reconfigure(encoding="utf-8", errors=NAME_BYTES)
            else:
                stream.reconfigure(errors="backslashreplace")


def _is_ascii(stream: TextIOWrapper) -> bool:
    return codecs.lookup(stream.encoding).name == "ascii"


def _name_bytes(error: UnicodeError) -> tuple[bytes, int]:
    """Handle a lone surrogate: as the byte that it stands for, or else as its escape."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = error.object[error.start : error.end]
    try:
        return text.encode("utf-8", "surrogateescape"), error.end
    except UnicodeEncodeError:
        return text.encode("ascii", "backslashreplace"), error.end


def flush_streams() -> None:
    """Write what is still in the buffers of stdout and stderr.

    Raises:
        OSError: A stream cannot be written.
    """
    sys.stdout.flush()
    sys.stderr.flush()


def discard_output() -> None:
    """Discard all further output, so that nothing fails while the process ends."""
    null = os.open(os.devnull, os.O_WRONLY)
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            os.dup2(null, stream.fileno())
    os.close(null)


def is_utf8(stream: object) -> bool:
    """Whether a stream takes every character; a text in memory does."""
    encoding = getattr(stream, "encoding", None) or "utf-8"
    return encoding.lower().replace("_", "-") in ("utf-8", "utf8")


def exact(text: str) -> str:
    """Return a YAML text for stdout; as ASCII with YAML's own escapes if stdout is not UTF-8."""
    return text if is_utf8(sys.stdout) else text.encode("ascii", "backslashreplace").decode()
