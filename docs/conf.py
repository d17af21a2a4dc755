"""Settings of the documentation site, which `make docs` builds with Sphinx.

Pages are plain Markdown; their links also work in the repository. On the site two things differ:
some pages come from outside of this folder, and links to other files lead to copies of them.
"""

import re
import sys
from os.path import relpath
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
ROOT = DOCS.parent
sys.path.insert(0, str(DOCS))

project = "rbstab"
author = "the rbstab developers"
project_copyright = "2026, the rbstab developers; license BSD-3-Clause"
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "site_commands",
    "site_console",
]

html_theme = "furo"
html_title = "rbstab"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_favicon = "_static/icon.svg"
html_show_sphinx = False
html_show_sourcelink = False
html_theme_options = {"navigation_with_keys": True}
pygments_style = "default"
pygments_dark_style = "github-dark"

# Copied is what one types: no prompts, and no output.
copybutton_prompt_text = r"\$ |>>> |\.\.\. "
copybutton_prompt_is_regexp = True

myst_heading_anchors = 4
smartquotes = False  # ' is the transpose, and -- begins an option
default_role = "code"  # of docstrings

# `make docs` needs no network; `make docs-links` checks external links.
linkcheck_timeout = 20
linkcheck_ignore = [r"https://doi\.org/"]  # publishers refuse programs; a DOI stays

autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_member_order = "bysource"

OUTSIDE = {
    "README.md": "index.md",
    "results/README.md": "result_files.md",
    "CHANGELOG.md": "changes.md",
    "CONTRIBUTING.md": "contributing.md",
    "configs/examples": "gallery.md",
    "configs/examples/sliding": "gallery.md",
    "configs/sweeps": "gallery.md",
}
"""What is outside of this folder, and the page of the site that shows it."""

LINK = re.compile(r"(?<=\]\()(?!\w+:)([^)#\s]+)(?=(?:#[^)\s]*)?\))")


def on_the_site(text: str, folder: Path) -> str:
    """Return a page with its links and pictures as the site needs them.

    Args:
        text: The page.
        folder: The folder to which its links are relative.
    """

    def moved(found: re.Match[str]) -> str:
        target = (folder / found[1]).resolve()
        if not target.exists() or not target.is_relative_to(ROOT):
            return found[0]  # a broken link: MyST reports it
        inside = target.relative_to(ROOT).as_posix()
        return OUTSIDE.get(inside, relpath(target, DOCS))

    return LINK.sub(moved, text)


def _read_page(_app: Any, name: str, content: list[str]) -> None:
    content[0] = on_the_site(content[0], (DOCS / name).parent)


def _read_included(_app: Any, path: Path, _parent: str, content: list[str]) -> None:
    content[0] = on_the_site(content[0], (DOCS / path).resolve().parent)


def _read_docstring(*event: Any) -> None:
    # |θ2| is an absolute value here, not a substitution.
    lines = event[-1]
    lines[:] = [line.replace("|", "\\|") for line in lines]


def setup(app: Any) -> None:
    """Connect the changes of pages to events of Sphinx; each event begins with the application."""
    app.connect("autodoc-process-docstring", _read_docstring)
    app.connect("source-read", _read_page)
    app.connect("include-read", _read_included)
