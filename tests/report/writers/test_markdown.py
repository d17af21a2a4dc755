"""Protects reports in Markdown, read back by an independent parser."""

from html.parser import HTMLParser

import numpy as np
import pytest
from markdown_it import MarkdownIt

from rbstab.report.model.document import (
    Cell,
    Head,
    Report,
    Section,
    Table,
    Unread,
)
from rbstab.report.model.figure import Axis, Figure, Line, Panel
from rbstab.report.writers.markdown import markdown, write_markdown

TAGS = {"h1", "h2", "p", "table", "thead", "tbody", "tr", "th", "td", "strong", "em", "img"}
TAGS |= {"ul", "li"}
"""The tags of a report in Markdown."""

HOSTILE = [
    "<script>alert(1)</script>",
    "<img src=x onerror=alert(1)>",
    "&lt;b&gt; &amp; &copy;",
    "**bold** __bold__ *em* _em_ ~~gone~~",
    "[a link](http://example.org) ![a picture](x.png) <http://example.org>",
    "[x]: http://example.org",
    "[x][y] [^1]",
    "a | b || c",
    "`code` ```fence```",
    "# heading",
    "- item",
    "+ item",
    "1. item",
    "2) item",
    "---",
    "===",
    "> quote",
    "back\\slash \\| \\[ \\",
    "$x^2$",
    "{{ 7 * 7 }} {% raw %}",
    "    indented",
    "line\nbreak\r\nand\ttab",
    "\x1b[31mred\u202egnp.exe\u2066 \x00",
    "a" * 5000,
    "http://example.org www.example.org a@example.org",
    "é – θ 連結 😀",
]


class Text(HTMLParser):
    """The tags, attributes and text of a page."""

    def __init__(self, page):
        super().__init__()
        self.tags, self.words, self.attributes = [], [], []
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [name for name, _ in attrs]

    def handle_data(self, data):
        self.words.append(data)

    @property
    def text(self):
        return "".join(self.words)


def read(text):
    parser = MarkdownIt("commonmark", {"html": True}).enable(["table", "strikethrough"])
    return Text(parser.render(text))


def shown(text):
    """Return a hostile text as it is shown: in one line, with control characters escaped."""
    plain = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
    return plain.strip()


def report_with(text, *blocks):
    table = Table("t", text, (Head(text), Head(text, text)), ((Cell(text), Cell(text)),), text)
    section = Section("s", text, (text, table, *blocks))
    return Report(text, text, text, (section,), (Unread(text, text),))


@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_hostile_texts_are_text_everywhere(text):
    page = read(markdown(report_with(text), {}))
    assert set(page.tags) <= TAGS
    assert set(page.attributes) <= {"style"}
    assert page.tags.count("h1") == page.tags.count("li") == page.tags.count("table") == 1
    # Report: title, time, command, section, paragraph. Table: title, two heads, unit, two cells,
    # note. Unread file: name and reason.
    assert page.text.count(shown(text)) == 14
    assert page.text.isprintable() or set(filter(lambda c: not c.isprintable(), page.text)) == {
        "\n"
    }


def figure(name, slope=1.0):
    x = np.linspace(0, 1, 5)
    panel = Panel(Axis("x"), Axis("y"), (Line(x, slope * x),))
    return Figure(name, "A <figure>", (panel,), caption="It | rises.")


def pictures(folder):
    return sorted(path.name for path in folder.iterdir())


def test_pictures_stand_beside_the_report(tmp_path):
    write_markdown(report_with("x", figure("one"), figure("two")), tmp_path / "my report.md")
    folder = tmp_path / "my report_files"
    names = pictures(folder)
    assert [name.split(".")[0] for name in names] == ["one", "two"]
    for name in names:
        assert (folder / name).read_bytes().startswith(b"<svg")
    text = (tmp_path / "my report.md").read_text()
    for name in names:
        assert f"(my%20report_files/{name})" in text
    assert "A <figure>. It | rises." in read(text).text


def test_old_pictures_give_way_and_other_files_do_not(tmp_path):
    path, folder = tmp_path / "a.md", tmp_path / "a_files"
    write_markdown(report_with("x", figure("one")), path)
    [old] = pictures(folder)
    (folder / "mine.png").write_bytes(b"")
    write_markdown(report_with("x", figure("one", slope=2.0)), path)
    names = pictures(folder)
    assert old not in names
    assert "mine.png" in names
    assert len(names) == 2


def test_without_figures_there_is_no_folder(tmp_path):
    write_markdown(report_with("x"), tmp_path / "a.md")
    assert [path.name for path in tmp_path.iterdir()] == ["a.md"]
