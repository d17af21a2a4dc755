"""What is wrong with the lines of a YAML text that a parser refuses: indentation, colons, brackets.

A parser reports where it can read no further, often a line below and in its own words.
"""

import re
from typing import NamedTuple

_KEY = re.compile(r"""("[^"]*"|'[^']*'|[^\s:,\[\]{}#&*!|>'"%@`-][^:]*?):(?=\s|$)""")
_NO_SPACE = re.compile(r"[A-Za-z_][A-Za-z0-9_.]*:(?=[^\s:/])")
_QUOTED = re.compile(r'"(\\.|[^"\\])*"|\'[^\']*\'')
_COMMENT = re.compile(r"(^|\s)#.*")


class LineProblem(NamedTuple):
    """A wrong line: its number and column, from 1, what is wrong and what is expected."""

    line: int
    column: int
    problem: str
    expected: str


class _Level(NamedTuple):
    """An open level of a text: its indentation, and the last line that has it."""

    indent: int
    line: int


def wrong_line(text: str, last: int) -> LineProblem | None:
    """Return the first wrong line of a text that cannot be read; None if no line looks wrong.

    Args:
        text: The text.
        last: The number of the line at which the parser stopped.
    """
    levels, opens, block, bracket, depth = [_Level(0, 1)], True, -1, 0, 0
    for number, line in enumerate(text.split("\n")[:last], start=1):
        content = _COMMENT.sub("", _QUOTED.sub('""', line)).strip()
        indent = len(line) - len(line.lstrip(" "))
        if not content or content in ("---", "...") or indent > block >= 0:
            continue
        block = -1
        if depth == 0:
            problem = _indentation(levels, number, indent, opens=opens) or _colon(content)
            if problem is not None:
                return LineProblem(number, indent + 1, *problem)
            bracket = number
        depth += sum(map(content.count, "[{")) - sum(map(content.count, "]}"))
        opens = content.endswith(":") or content == "-"
        block = indent if content.endswith(("|", ">", "|-", ">-")) else -1
    if depth > 0:
        return LineProblem(bracket, 1, "has a bracket that is not closed", "] or }")
    return None


def _indentation(
    levels: list[_Level], number: int, indent: int, *, opens: bool
) -> tuple[str, str] | None:
    """Check the indentation of a line, and open or close levels.

    Args:
        levels: The open levels; changed in place.
        number: The number of the line.
        indent: Its spaces.
        opens: Whether the line above is a key without a value.
    """
    above = levels[-1]
    if indent > above.indent and not opens:
        found = f"is indented by {_spaces(indent)}, but the line above has a value"
        return found, f"{_spaces(above.indent)}, as line {above.line} has"
    if indent > above.indent:
        levels.append(_Level(indent, number))
    while indent < levels[-1].indent:
        levels.pop()
    if indent != levels[-1].indent:
        found = f"is indented by {_spaces(indent)}"
        others = f"{_spaces(above.indent)}, as line {above.line} has, or {levels[-1].indent}"
        return found, f"{others}"
    levels[-1] = _Level(indent, number)
    return None


def _colon(content: str) -> tuple[str, str] | None:
    """Check that a line is a key with a colon and a space, an entry of a list, or in brackets."""
    if content.startswith(("- ", "{", "[", '""', "?", "%", "&", "!", "*")) or content == "-":
        return None
    if _KEY.match(content):
        return None
    if found := _NO_SPACE.match(content):
        return f"has no space after {found[0]}", f"{found[0]} {content[found.end() :]}"
    if content.startswith("-"):
        return "has no space after -", f"- {content[1:]}"
    return "has no colon", "a key, a colon and a value"


def _spaces(count: int) -> str:
    return f"{count} space{'' if count == 1 else 's'}"
