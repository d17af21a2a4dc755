"""A report as Markdown, with its figures as pictures in a folder beside it."""

import hashlib
import re
from collections.abc import Mapping
from pathlib import Path
from urllib.parse import quote

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from rbstab.config.errors import printable
from rbstab.report.model.document import Motion, Report, Table
from rbstab.report.model.figure import Figure
from rbstab.report.writers.signature import SIGNATURES
from rbstab.store.atomic import write_atomically

PICTURE = re.compile(r"[a-z0-9-]+\.[0-9a-f]{12}\.png")
"""How the pictures of reports are called: a figure, and what it looks like."""

DOTS_PER_INCH = 150

_STEERING = re.compile(r"[\\`*_|~$]|\](?=[\[(:])|^#|^[-+](?=[\s+-])|(?<=:)/")
_NUMBERED = re.compile(r"^(\d+)(?=[.)](\s|$))")


def write_markdown(report: Report, path: Path) -> None:
    """Writes a report, and its pictures into the folder `NAME_files` beside it.

    Pictures are called by their content, and come first: whatever happens on the way, the old
    report has its own. Pictures that the new one does not show are removed at the end.

    Args:
        report: The report.
        path: The file; it is replaced, and its folder must exist.

    Raises:
        OSError: The operating system refused.
    """
    folder = path.with_name(f"{path.stem}_files")
    pictures = _write_pictures(report, folder)
    links = {name: quote(f"{folder.name}/{picture}") for name, picture in pictures.items()}
    write_atomically(path, markdown(report, links).encode() + SIGNATURES["md"], replace=True)
    if folder.is_dir():
        for old in folder.iterdir():
            if PICTURE.fullmatch(old.name) and old.name not in pictures.values():
                old.unlink(missing_ok=True)


def markdown(report: Report, pictures: Mapping[str, str]) -> str:
    """The text.

    Args:
        report: The report.
        pictures: Where the picture of each figure is, by the figure's name.
    """
    environment = Environment(
        loader=PackageLoader("rbstab.report.writers"),
        # Whatever a filter forgets is escaped as HTML, which Markdown may hold.
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["md"] = escaped
    environment.tests["table"] = lambda block: isinstance(block, Table)
    environment.tests["figure"] = lambda block: isinstance(block, Figure)
    environment.tests["motion"] = lambda block: isinstance(block, Motion)
    template = environment.get_template("report.md.j2")
    return template.render(report=report, pictures=pictures) + "\n"


def escaped(text: str) -> Markup:
    """A text of which Markdown and HTML take nothing for their own, in one line."""
    plain = _STEERING.sub(lambda found: f"\\{found.group()}", printable(text).strip())
    # A line that begins with a number and a dot would begin a list.
    return Markup(escape(_NUMBERED.sub(r"\1\\", plain)))  # noqa: S704 escaped here


def _write_pictures(report: Report, folder: Path) -> dict[str, str]:
    """Writes the picture of each figure; their file names, by the names of the figures."""
    # Imported late: a report without figures needs no matplotlib.
    from rbstab.report.writers.matplotlib_figures.renderer import png

    found = {}
    figures = [block for s in report.sections for block in s.blocks if isinstance(block, Figure)]
    for figure in figures:
        folder.mkdir(exist_ok=True)
        content = png(figure, dpi=DOTS_PER_INCH)
        name = f"{figure.name}.{hashlib.sha256(content).hexdigest()[:12]}.png"
        write_atomically(folder / name, content, replace=True)
        found[figure.name] = name
    return found
