"""What is wrong with the lines of a YAML text that a parser refuses: indentation, colons, brackets.

A parser reports where it can read no further, often a line below and in its own words.
"""

import re
from collections.abc import Sequence

_KEY = re.compile(r"""("+|[^\s:,\[\]{}#&*!|>'"%@`-][^:]*?):(?=\s|$)""")
_NO_SPACE = re.compile(r"[A-Za-z_][A-Za-z0-9_.]*:(?=[^\s:/])")
_QUOTED = re.compile(r'"(\\.|[^"\\])*"|\'[^\']*\'')
_COMMENT = re.compile(r"(^|\s)#.*")
_CLOSING = {"[": "]", "{": "}"}


LineProblem = tuple[int, int, str, str]
"""A wrong line: its number and column, from 1, what is wrong and what is expected."""

_Level = tuple[int, int]
"""An open level of a text: its indentation, and the last line that has it."""


def wrong_line(lines: Sequence[str]) -> LineProblem | None:
    """Return the first wrong line of a text that cannot be read; None if no line looks wrong.

    Args:
        lines: The lines up to that at which the parser stopped.
    """
    indent = re.match(r"\s*", lines[-1]) if lines else None
    if indent is not None and "\t" in indent[0]:
        expected = "spaces: YAML is not indented with tabs"
        return len(lines), indent[0].index("\t") + 1, "begins with a tab", expected
    levels, opens, block = [(0, 1)], True, -1
    brackets: list[tuple[int, int, str]] = []
    for number, line in enumerate(lines, start=1):
        # Quotes keep their length, so columns stay.
        content = _COMMENT.sub("", _QUOTED.sub(lambda text: '"' * len(text[0]), line)).rstrip()
        at = len(content) - len(content.lstrip(" "))
        if content.strip() in ("", "---", "...") or at > block >= 0:
            continue
        if not brackets:
            problem = _indentation(levels, number, at, opens=opens) or _colon(content[at:])
            if problem is not None:
                return number, at + 1, *problem
        for column, sign in enumerate(content, start=1):
            if sign in _CLOSING:
                brackets.append((number, column, _CLOSING[sign]))
            elif brackets and sign in _CLOSING.values():
                if sign != brackets[-1][2]:
                    return _not_closed(*brackets[-1])
                brackets.pop()
        opens = content.endswith(":") or content.strip() == "-"
        block = at if content.endswith(("|", ">", "|-", ">-")) else -1
    return _not_closed(*brackets[-1]) if brackets else None


def _not_closed(line: int, column: int, closing: str) -> LineProblem:
    return line, column, "has a bracket that is not closed", closing


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
    above, line = levels[-1]
    if indent > above and not opens:
        found = f"is indented by {_spaces(indent)}, but the line above has a value"
        return found, f"{_spaces(above)}, as line {line} has"
    while indent < levels[-1][0]:
        levels.pop()
    if above > indent > levels[-1][0]:
        others = f"{_spaces(above)}, as line {line} has, or {levels[-1][0]}"
        return f"is indented by {_spaces(indent)}", others
    if indent == levels[-1][0]:
        levels.pop()
    levels.append((indent, number))
    return None


def _colon(content: str) -> tuple[str, str] | None:
    """Check that a line is a key with a colon and a space, an entry of a list, or in brackets."""
    if content.startswith(("- ", "{", "[", "?", "%", "&", "!", "*")) or content == "-":
        return None
    if content.startswith('"') or _KEY.match(content):
        return None
    if found := _NO_SPACE.match(content):
        return f"has no space after {found[0]}", f"{found[0]} {content[found.end() :]}"
    if content.startswith("-"):
        return "has no space after -", f"- {content[1:]}"
    return "has no colon", "a key, a colon and a value"


def _spaces(count: int) -> str:
    return f"{count} space{'' if count == 1 else 's'}"
