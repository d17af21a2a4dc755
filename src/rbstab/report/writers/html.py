"""A report as one page: a single file that needs no network.

Everything is in it: the tables as HTML, the figures as data for plotly, plotly itself, and the
scripts. The browser is told by a content security policy to load nothing, and to run no script
but these, known by their digests; so a text that slipped through as markup could do no harm.
"""

import base64
import gzip
import hashlib
from functools import cache
from importlib import resources
from typing import Any

from markupsafe import Markup

from rbstab.report.model.document import Motion, Report, Table
from rbstab.report.model.figure import Figure
from rbstab.report.writers.plotly_figures.renderer import JSON, drawn
from rbstab.report.writers.plotly_figures.text import numbers

SCRIPTS = ("theme", "tables", "time", "figures", "scene", "motions", "start")
"""The page's own scripts, in the order in which they are run."""


def page(report: Report) -> str:
    """A report as one HTML page."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("rbstab.report.writers"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.policies["json.dumps_kwargs"] = {"allow_nan": False, "separators": (",", ":")}
    environment.tests["table"] = lambda block: isinstance(block, Table)
    environment.tests["figure"] = lambda block: isinstance(block, Figure)
    environment.tests["motion"] = lambda block: isinstance(block, Motion)
    blocks = [block for section in report.sections for block in section.blocks]
    script = "".join(_own(f"{name}.js") for name in SCRIPTS)
    text = environment.get_template("page.html").render(
        report=report,
        style=Markup(_own("page.css")),  # noqa: S704  (our own file)
        script=Markup(script),  # noqa: S704  (our own file)
        policy=_policy(script),
        library=_packed_library() if any(isinstance(b, Figure) for b in blocks) else "",
        drawings={block.name: drawn(block) for block in blocks if isinstance(block, Figure)},
        motions={block.name: _moving(block) for block in blocks if isinstance(block, Motion)},
        has_time=any(isinstance(block, Motion) for block in blocks),
    )
    # A file's name may hold bytes that are no text.
    return text.encode("utf-8", "replace").decode("utf-8")


def _moving(motion: Motion) -> JSON:
    """A motion as the page's script reads it."""
    arrays = {
        "times": motion.times,
        "positions": motion.positions,
        "rotations": motion.rotations,
        "vertices": motion.solid.vertices,
    }
    moving: dict[str, Any] = {name: numbers(array.ravel()) for name, array in arrays.items()}
    return moving | {
        "triangles": motion.solid.triangles.ravel().tolist(),
        "contact_point": motion.contact_point.tolist(),
        "anchor": None if motion.anchor is None else motion.anchor.tolist(),
    }


def _policy(script: str) -> str:
    digests = " ".join(f"'sha256-{_digest(text)}'" for text in (script, _library()))
    return (
        f"default-src 'none'; script-src {digests}; style-src 'unsafe-inline'; "
        "img-src data: blob:; base-uri 'none'; form-action 'none'"
    )


def _digest(text: str) -> str:
    return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")


def _own(name: str) -> str:
    folder = resources.files("rbstab.report.writers") / "templates"
    return (folder / name).read_text(encoding="utf-8")


@cache
def _library() -> str:
    # Only pages need plotly, which takes long to import; its bundle is a file beside it.
    return (resources.files("plotly") / "package_data" / "plotly.min.js").read_text("utf-8")


@cache
def _packed_library() -> str:
    """Plotly, compressed to less than half: browsers unpack it themselves."""
    packed = gzip.compress(_library().encode("utf-8"), compresslevel=9, mtime=0)
    return base64.b64encode(packed).decode("ascii")
