"""The files of a report: its signature, and the folder of its pictures.

A report may replace only files that have the signature at their end.
"""

from pathlib import Path

_TEXT = b"made by rbstab report"

SIGNATURES = {
    "html": b"<!-- " + _TEXT + b" -->\n",
    "md": b"\n<!-- " + _TEXT + b" -->\n",
    "pdf": b"%" + _TEXT + b"\n",
    "text": _TEXT.capitalize() + b"\n",
}
"""The last bytes of a report, by its format."""


def is_report(path: Path) -> bool:
    """Return whether a file is a report of any format.

    Raises:
        OSError: The file cannot be read.
    """
    with path.open("rb") as file:
        size = file.seek(0, 2)
        length = max(map(len, SIGNATURES.values()))
        file.seek(max(0, size - length))
        end = file.read()
    return any(end.endswith(signature) for signature in SIGNATURES.values())


def pictures_folder(path: Path) -> Path:
    """Return the folder of the pictures of a report in Markdown."""
    return path.with_name(f"{path.stem}_files")
