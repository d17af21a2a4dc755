"""A report as Markdown, with its figures as SVG files in a folder beside it."""

import hashlib
import re
from collections.abc import Mapping
from pathlib import Path
from urllib.parse import quote

from markupsafe import Markup, escape

from rbstab.files.paths import is_dir
from rbstab.files.text import printable
from rbstab.report.model.document import Report
from rbstab.report.writers.figure_files import figure_bytes, figures_of
from rbstab.report.writers.signature import SIGNATURES, pictures_folder
from rbstab.report.writers.templating import environment_of
from rbstab.store.disk.atomic import write_atomically

PICTURE = re.compile(r"[a-z0-9-]+\.[0-9a-f]{12}\.svg")
"""File names of pictures: the name of the figure, and a digest of the file."""

_MARKUP = re.compile(r"[\\`*_|~$]|\](?=[\[(:])|^#|^[-+](?=[\s+-])|(?<=:)/")
_LIST_NUMBER = re.compile(r"^(\d+)(?=[.)](\s|$))")


def write_markdown(report: Report, path: Path) -> None:
    """Write a report, and its pictures into the folder `NAME_files` beside it.

    The pictures are written first, under names that contain their digests. So an old report keeps
    its pictures if an error occurs. Pictures that the new report does not use are deleted last.

    Args:
        report: The report.
        path: The file; it is replaced, and its folder must exist.

    Raises:
        OSError: The operating system raised an error.
    """
    folder = pictures_folder(path)
    pictures = _write_pictures(report, folder)
    links = {name: quote(f"{folder.name}/{picture}") for name, picture in pictures.items()}
    write_atomically(path, markdown(report, links).encode() + SIGNATURES["md"], replace=True)
    if is_dir(folder):
        for old in folder.iterdir():
            if PICTURE.fullmatch(old.name) and old.name not in pictures.values():
                old.unlink(missing_ok=True)


def markdown(report: Report, pictures: Mapping[str, str]) -> str:
    """Return the Markdown text of a report.

    Args:
        report: The report.
        pictures: The link to the picture of each figure, by the name of the figure.
    """
    environment = environment_of()
    environment.filters["md"] = escaped
    template = environment.get_template("report.md.j2")
    return template.render(report=report, pictures=pictures) + "\n"


def escaped(text: str) -> Markup:
    """Escape a text for Markdown and HTML, and put it on one line."""
    plain = _MARKUP.sub(lambda match: f"\\{match.group()}", printable(text).strip())
    # A number and a dot at the start of a line would start a list.
    return Markup(escape(_LIST_NUMBER.sub(r"\1\\", plain)))  # noqa: S704 escaped here


def _write_pictures(report: Report, folder: Path) -> dict[str, str]:
    """Write the pictures of figures; return their file names by the names of the figures."""
    names = {}
    for key, figure in figures_of(report).items():
        content = figure_bytes(figure, "svg")
        folder.mkdir(exist_ok=True)
        name = f"{key}.{hashlib.sha256(content).hexdigest()[:12]}.svg"
        write_atomically(folder / name, content, replace=True)
        names[key] = name
    return names
