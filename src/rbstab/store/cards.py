"""Results in one line, and as small HTML cards, for the interpreter and for notebooks.

Texts of results are untrusted: they are printable in a line, and escaped in a card.
"""

from collections.abc import Iterable, Sequence
from html import escape
from importlib import import_module
from types import ModuleType

MAX_TEXT = 200
"""The most characters of a text in a line or a card."""


_CARD = (
    '<div style="border:1px solid #8888;border-radius:6px;padding:0.6em 0.9em;'
    'display:inline-block;font-family:sans-serif;font-size:0.9em">'
)


def line(kind: str, title: str, facts: Sequence[str]) -> str:
    """Return `<rbstab.Result "A title": completed, 401 samples>`."""
    name = f' "{printable(title)}"' if title else ""
    return f"<rbstab.{kind}{name}: {', '.join(map(printable, facts))}>"


def card(kind: str, title: str, facts: Iterable[tuple[str, str]]) -> str:
    """Return an HTML card: a heading, and a line for each fact."""
    rows = "".join(
        f'<tr><td style="text-align:left;padding-right:1em;opacity:0.7">{_html(name)}</td>'
        f'<td style="text-align:left">{_html(value)}</td></tr>'
        for name, value in facts
    )
    heading = f"<strong>{_html(title or 'untitled')}</strong> <small>rbstab.{kind}</small>"
    return f"{_CARD}{heading}<table>{rows}</table></div>"


def printable(text: object) -> str:
    """Return a text of any origin on one line, cut if it is long."""
    shown = "".join(c if c.isprintable() else "?" for c in str(text)[: MAX_TEXT + 1])
    return shown if len(shown) <= MAX_TEXT else f"{shown[: MAX_TEXT - 1]}…"


def optional_module(name: str, extra: str) -> ModuleType:
    """Import a package that only an extra of the installation has.

    Raises:
        ImportError: It is not installed; the message has the command that installs it.
    """
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        raise ImportError(
            f'this needs the package {error.name}. Run: pip install "rbstab[{extra}]"',
            name=error.name,
        ) from error


def _html(text: object) -> str:
    return escape(printable(text))
