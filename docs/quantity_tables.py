"""Write the tables of arrays and columns in results/README.md from the table of quantities.

`make docs` runs it, after a quantity was added or described anew. A test compares the page.
"""

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from rbstab.sweep.members.outcome import COLUMNS
from rbstab.systems.quantities import QUANTITIES

PAGE = Path(__file__).parents[1] / "results" / "README.md"

_TABLE = re.compile(r"(<!-- (quantities|columns|traces) -->\n).*?(<!-- end -->)", flags=re.DOTALL)


def rows(kind: str) -> Iterator[tuple[str, Iterable[str], str, str]]:
    """Yield the name, the dimensions, the unit and the meaning of what a table lists."""
    if kind == "columns":
        for name, column in COLUMNS.items():
            yield name, ("run", *column.dimensions), column.unit, column.long_name
        return
    for one in QUANTITIES:
        words = one.meaning if one.symbol == "-" else f"{one.symbol}, {one.meaning}"
        yield one.name, one.dimensions, one.unit, words


def table(kind: str) -> str:
    """Return the arrays of a run or the columns of a sweep as a table, or a list of traces."""
    if kind == "traces":
        return ", ".join(f"`{one.name}`" for one in QUANTITIES if one.trace) + "\n"
    lines = ["| array | dimensions | unit | meaning |", "|---|---|---|---|"]
    for name, dimensions, unit, words in rows(kind):
        cells = f"`{name}`", ", ".join(dimensions) or "-", unit, words.replace("|", r"\|")
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def filled(page: str) -> str:
    """Return the page with its tables written anew."""
    return _TABLE.sub(lambda found: found[1] + table(found[2]) + found[3], page)


if __name__ == "__main__":
    PAGE.write_text(filled(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
