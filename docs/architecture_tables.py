"""Write the tables of modules in architecture.md from the first line of each module's docstring.

`make docs` runs it, after a module was added, moved or described anew. A test compares the page.
"""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "architecture.md"

_TABLE = re.compile(r"(<!-- modules of (\S+) -->\n).*?(<!-- end -->)", flags=re.DOTALL)


def described(module: Path) -> str:
    """Return the first line of a module's docstring."""
    documentation = ast.get_docstring(ast.parse(module.read_text(encoding="utf-8")))
    return (documentation or "").split("\n")[0].replace("|", "\\|")


def table(folder: str) -> str:
    """Return the table of the modules in a folder, without those in its inner rooms."""
    modules = sorted(path for path in (ROOT / folder).glob("*.py") if path.stem[:2] != "__")
    rows = [f"| `{module.name}` | {described(module)} |" for module in modules]
    return "\n".join(["| module | what it is |", "|---|---|", *rows]) + "\n"


def filled(page: str) -> str:
    """Return the page with all its tables written anew."""
    return _TABLE.sub(lambda found: found[1] + table(found[2]) + found[3], page)


if __name__ == "__main__":
    PAGE.write_text(filled(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
