"""The templates of reports: they know the kinds of blocks, and escape all texts."""

from typing import TYPE_CHECKING

from rbstab.report.model.document import Animation, Cards, Table
from rbstab.report.model.figure import Figure

if TYPE_CHECKING:
    from jinja2 import Environment

KINDS = {"table": Table, "figure": Figure, "cards": Cards, "animation": Animation}
"""The kinds of blocks by the names that templates test."""


def environment_of() -> "Environment":
    """Return an environment for the templates of this package.

    A text that passes no filter is escaped as HTML, which is valid in Markdown too.
    """
    # Imported late: only two formats need it.
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("rbstab.report.writers"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    for name, kind in KINDS.items():
        environment.tests[name] = lambda block, kind=kind: isinstance(block, kind)
    return environment
