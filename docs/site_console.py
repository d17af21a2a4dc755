"""How the site shows sessions of a terminal: commands are coloured, and long sentences are wrapped.

Tables of outputs keep their lines, and scroll.
"""

import re
import textwrap
from typing import Any, ClassVar

from pygments.lexer import RegexLexer, bygroups, using
from pygments.lexers.shell import BashLexer
from pygments.token import Generic

WIDTH = 104
"""Characters of a line that fit beside the contents of a page."""

SESSION = re.compile(r"(?<=^```console\n)(.*?)(?=^```)|(?<=^```text\n)(.*?)(?=^```)", re.M | re.S)


class SessionLexer(RegexLexer):
    """Lines after `$ ` are commands; all others are output, whatever they begin with."""

    name = "Session"
    tokens: ClassVar[dict[str, Any]] = {
        "root": [
            (r"^(\$ )(.*\n?)", bygroups(Generic.Prompt, using(BashLexer))),
            (r".+\n?|\n", Generic.Output),
        ]
    }


def wrapped(page: str) -> str:
    """Return a page with the sentences of its sessions wrapped, as a terminal does."""
    return SESSION.sub(lambda found: "".join(map(_wrapped, found[0].splitlines(True))), page)


def _wrapped(line: str) -> str:
    words = line.rstrip("\n")
    indent = " " * (len(words) - len(words.lstrip()))
    is_table = len(re.findall(r"\S  +(?=\S)", words)) > 1
    if len(words) <= WIDTH or is_table or words.startswith("$ "):
        return line
    inner = {"initial_indent": indent, "subsequent_indent": indent + "    "}
    broken = textwrap.wrap(words.strip(), WIDTH, break_long_words=False, **inner)
    return "\n".join(broken) + "\n"


def _read(*event: Any) -> None:
    """Change the text of a page; events end with a list that has only this text."""
    content = event[-1]
    content[0] = wrapped(content[0])


def setup(app: Any) -> dict[str, bool]:
    """Connect the changes to Sphinx."""
    app.add_lexer("console", SessionLexer)
    app.connect("source-read", _read)
    app.connect("include-read", _read)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
