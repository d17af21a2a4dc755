"""The mark by which a file is known to be a report, which may be replaced."""

from pathlib import Path

_WORDS = b"made by rbstab report"

SIGNATURES = {
    "html": b"<!-- " + _WORDS + b" -->\n",
    "md": b"\n<!-- " + _WORDS + b" -->\n",
    "pdf": b"%" + _WORDS + b"\n",
    "text": _WORDS.capitalize() + b"\n",
}
"""The last bytes of a report, by its format."""


def is_report(path: Path) -> bool:
    """Whether a file is a report of any format.

    Raises:
        OSError: It cannot be read.
    """
    with path.open("rb") as file:
        size = file.seek(0, 2)
        longest = max(map(len, SIGNATURES.values()))
        file.seek(max(0, size - longest))
        end = file.read()
    return any(end.endswith(mark) for mark in SIGNATURES.values())
