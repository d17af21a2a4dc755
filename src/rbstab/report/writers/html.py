"""A report as one HTML file that needs no network.

The file contains the tables as HTML, the figures as Vega-Lite specifications, the bundle of Vega
that draws them, and the scripts. Its content security policy forbids the browser to load anything
or to run any other script; it lists the digests of the allowed scripts. So even an unescaped text
could do no harm.
"""

import base64
import gzip
import hashlib
import json
import re
from functools import cache
from importlib import resources
from typing import Any

from markupsafe import Markup, escape

from rbstab.report.model.document import MARKS, Animation, Cell, Head, Report, Sketch, Table
from rbstab.report.model.figure import Figure
from rbstab.report.model.palette import colour
from rbstab.report.model.words import unbroken
from rbstab.report.writers.sketches import svg
from rbstab.report.writers.templating import environment_of
from rbstab.report.writers.vega.marks import JSON
from rbstab.report.writers.vega.page_data import packed_array, page_data

SCRIPTS = (
    *("theme", "tables", "columns", "time", "arrays", "figures", "maps", "copies", "csv"),
    *("scene", "motions", "start"),
)
"""Names of the scripts of the page, in the order in which they run."""


JOINTS = re.compile(r"(?<=_)|(?<=[A-Za-z]\.)(?=[A-Za-z])")
"""Where a name may be broken: after an underscore, or a dot between words."""

OPTION = re.compile(r"(?<!\S)--[a-z][a-z-]*")
"""An option of a command, in a sentence."""

COPY = Markup(
    ' <button type="button" class="copy" data-command="{}" aria-label="{}" hidden>Copy</button>'
)
"""The button that copies a command; the page shows it if its scripts run."""

MAX_SHORT, MAX_MEDIUM = 28, 80
"""Characters of an entry that is not broken into lines, and of one that has a column of its own."""


def page(report: Report) -> str:
    """Render a report as one HTML page."""
    environment = environment_of()
    environment.policies["json.dumps_kwargs"] = {"allow_nan": False, "separators": (",", ":")}
    environment.filters["breakable"] = _breakable
    environment.filters["prose"] = _prose
    environment.filters["picture"] = _picture
    environment.globals["sketch_colour"] = colour
    environment.globals["rows"] = _rows
    environment.globals["marks"] = MARKS
    blocks = [block for section in report.sections for block in section.blocks]
    figures = [block for block in blocks if isinstance(block, Figure)]
    script = "".join(_template(f"{name}.js") for name in SCRIPTS)
    text = environment.get_template("page.html").render(
        report=report,
        style=Markup(_template("page.css")),  # noqa: S704  (our own file)
        script=Markup(script),  # noqa: S704  (our own file)
        policy=_policy(script),
        library=_base64(_bundle()) if figures else "",
        drawings=_packed({figure.name: page_data(figure) for figure in figures}),
        motions={
            block.name: _animation_data(block) for block in blocks if isinstance(block, Animation)
        },
        has_time=any(isinstance(block, Animation) for block in blocks),
    )
    # A file name may contain bytes that are not valid UTF-8.
    return text.encode("utf-8", "replace").decode("utf-8")


def _picture(sketch: Sketch) -> Markup:
    """Return a sketch as SVG, which escapes its texts itself."""
    return Markup(svg(sketch))  # noqa: S704


def _breakable(text: str) -> Markup:
    """Return a text whose names may be broken at their joints, rather than anywhere."""
    parts = JOINTS.split(unbroken(text))
    # `join` escapes the parts. Most texts of a table have one part.
    return Markup("<wbr>").join(parts) if len(parts) > 1 else escape(parts[0])


def _prose(text: str) -> Markup:
    """Return a sentence in which numbers keep their units, and options of commands stay whole."""
    marked = OPTION.sub(r'<span class="whole">\g<0></span>', str(escape(unbroken(text))))
    return Markup(marked)  # noqa: S704  (escaped above)


def _rows(table: Table) -> Markup:
    """Return the rows of a table."""
    # A page may have a hundred thousand entries, and a template takes several times as long.
    lines = []
    for row in table.rows:
        entries = zip(row, table.heads, strict=True)
        lines.append("      <tr>")
        lines += [f"        {_entry(*pair, number == 0)}" for number, pair in enumerate(entries)]
        lines.append("      </tr>")
    # All that is not our own was escaped.
    return Markup("\n".join(lines))  # noqa: S704


def _entry(cell: Cell, head: Head, first: bool) -> str:
    """Return an entry of a table, with its texts escaped."""
    tag, of_row = ("th", ' scope="row"') if first else ("td", "")
    classes = _entry_classes(cell, head, first)
    of_class = f' class="{classes}"' if classes else ""
    value = "" if cell.value is None else f' data-value="{escape(cell.value)}"'
    mark = ""
    if cell.tone:
        mark = f'<span class="mark" aria-hidden="true">{MARKS.get(cell.tone, "")}</span>'
    text = _breakable(cell.text)
    if cell.command:
        label = f"Copy the command: {cell.command}"
        text += COPY.format(cell.command, label)
    if cell.target:
        text = Markup('<a href="#{}">{}</a>').format(cell.target, text)
    return f"<{tag}{of_row}{of_class}{value}>{mark}{text}</{tag}>"


def _entry_classes(cell: Cell, head: Head, first: bool) -> str:
    """Return the classes of an entry of a table."""
    length = len(cell.text)
    classes = ["number"] if head.numbers else []
    if length <= MAX_SHORT and not first:
        classes.append("short")
    if length > MAX_MEDIUM:
        classes.append("long")
    return " ".join([*classes, cell.tone] if cell.tone else classes)


def _animation_data(animation: Animation) -> JSON:
    """Return an animation in the format that `motions.js` reads."""
    arrays = {
        "times": animation.times,
        "positions": animation.positions,
        "rotations": animation.rotations,
        "vertices": animation.solid.vertices,
    }
    data: dict[str, Any] = {name: packed_array(array.ravel()) for name, array in arrays.items()}
    return data | {
        "triangles": animation.solid.triangles.ravel().tolist(),
        "contact_point": animation.contact_point.tolist(),
        "anchor": None if animation.anchor is None else animation.anchor.tolist(),
        "ties": [
            {
                "point": tie.point.tolist(),
                "anchor": tie.anchor.tolist(),
                "loads": packed_array(tie.loads),
            }
            for tie in animation.ties
        ],
    }


def _policy(script: str) -> str:
    digests = " ".join(
        f"'sha256-{_digest(text)}'" for text in (script, gzip.decompress(_bundle()).decode())
    )
    return (
        f"default-src 'none'; script-src {digests}; style-src 'unsafe-inline'; "
        "img-src data: blob:; base-uri 'none'; form-action 'none'"
    )


def _digest(text: str) -> str:
    return _base64(hashlib.sha256(text.encode()).digest())


def _template(name: str) -> str:
    folder = resources.files("rbstab.report.writers") / "templates"
    return (folder / name).read_text(encoding="utf-8")


@cache
def _bundle() -> bytes:
    """Return Vega, Vega-Lite and Vega-Embed as one script, compressed."""
    return (resources.files("rbstab.report.writers.vega") / "bundle.js.gz").read_bytes()


def _packed(data: JSON) -> str:
    """Return data as compressed JSON in base64; the browser decompresses it."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return _base64(gzip.compress(text.encode(), compresslevel=6, mtime=0))


def _base64(content: bytes) -> str:
    return base64.b64encode(content).decode("ascii")
