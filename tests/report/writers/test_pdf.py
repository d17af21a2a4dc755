"""Protects reports in PDF, read back by an independent library."""

from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
from pypdf import PdfReader
from pypdf.generic import Destination
from support.pages import motion

from rbstab.report.model.document import Cell, Head, Report, Section, Table, Unread
from rbstab.report.model.figure import Axis, Figure, Line, Panel
from rbstab.report.writers.pdf import pdf_of

X = np.linspace(0, 1, 5)

PANEL = Panel(Axis("across"), Axis("up"), (Line(X, X**2),))

FIGURE = Figure("f", "A curve", (PANEL,), caption="It rises.")

HOSTILE = [
    "#let x = 1",
    "*bold* _u_",
    "$x$ [a] (b\\c)",
    "<b>&amp;</b>",
    '"; #panic()',
    "%PDF",
    "@a",
]


def report(*blocks, title="A report", **options):
    sections = (Section("first", "The first section", blocks), Section("second", "The second", ()))
    return Report(title, "2026-01-02T03:04:05", "rbstab report a.h5 --pdf", sections, **options)


def read(made):
    return PdfReader(BytesIO(pdf_of(made)))


def text_of(reader):
    return " ".join(" ".join(page.extract_text() for page in reader.pages).split())


def table_of(columns, rows, **options):
    heads = [Head("name"), *(Head(f"h{c}", "m", numbers=True) for c in range(1, columns))]
    cells = [tuple(Cell(f"c{row}-{c}") for c in range(columns)) for row in range(rows)]
    return Table("t", "A table", tuple(heads), tuple(cells), **options)


def test_everything_that_the_report_says_is_there():
    table = table_of(3, 2, note="Mind the gap.")
    unread = (Unread("results/b.h5", "it is damaged"),)
    blocks = ("A paragraph with Θ, ω² and v'.", table, FIGURE, motion())
    reader = read(report(*blocks, unread=unread))
    text = text_of(reader)
    for expected in (
        "A report",
        "Made 2026-01-02 03:04 by rbstab report a.h5",
        "The first section",
        "A paragraph with Θ, ω² and v",
        "A table",
        "h1 [m]",
        "c1-2",
        "Mind the gap.",
        "Figure 1: A curve. It rises.",
        # The words at the axes of the figure are letters, and no picture.
        "across",
        "the HTML report has the animation.",
        "Results that could not be read",
        "results/b.h5: it is damaged",
    ):
        assert expected in text, expected
    assert reader.metadata.title == "A report"


def test_pages_are_of_paper_and_numbered():
    reader = read(report(*["A paragraph of some length. " * 40] * 12))
    assert len(reader.pages) > 2
    for number, page in enumerate(reader.pages, start=1):
        width, height = page.mediabox.width, page.mediabox.height
        assert (round(width / 72 * 25.4), round(height / 72 * 25.4)) == (210, 297)
        assert page.extract_text().split()[-3:] == [str(number), "/", str(len(reader.pages))]


def test_the_outline_has_the_sections():
    reader = read(report("Words.", unread=(Unread("b", "c"),)))
    titles = [entry.title for entry in reader.outline if isinstance(entry, Destination)]
    assert titles == ["The first section", "The second", "Results that could not be read"]


def test_a_long_table_repeats_its_heads():
    reader = read(report(table_of(3, 200)))
    assert len(reader.pages) > 2
    assert all("h1 [m]" in page.extract_text() for page in list(reader.pages)[:2])


@pytest.mark.parametrize("text", HOSTILE)
def test_texts_are_plain(text):
    table = Table("t", text, (Head(text),), ((Cell(text),),), note=text)
    figure = replace(FIGURE, title=text, caption=text)
    printed = text_of(read(report(text, table, figure, title=text)))
    assert printed.count(text) == 8


def test_a_name_that_is_no_text_is_written(capfd):
    assert "b" in text_of(read(report("\ud800 連 a\tb\nc \x00 \x1b[31m")))
    assert capfd.readouterr() == ("", "")
