"""Protects reports as text: every word and number appears, within the width of the terminal."""

from io import StringIO

import pytest
from rich.console import Console

from rbstab.report.model.document import Cell, Head, Report, Section, Table
from rbstab.report.writers.text import print_report

WORDS = Head("name")
NUMBERS = [Head(f"number {k}", "J", numbers=True) for k in range(8)]


def table(rows=3, heads=(WORDS, *NUMBERS)):
    made = tuple(
        (Cell(f"row {r}"), *(Cell(f"{r}.{k}23456e-10") for k in range(len(heads) - 1)))
        for r in range(rows)
    )
    return Table("t", "A table", tuple(heads), made, "A note.")


def printed(report, width=80):
    text = StringIO()
    print_report(report, Console(file=text, width=width, color_system=None))
    return text.getvalue()


def report(*blocks, title="A title", unread=()):
    return Report(
        title, "2026-01-01", "rbstab report a.h5", (Section("s", "A section", blocks),), unread
    )


@pytest.mark.parametrize("width", [60, 80, 120, 300])
def test_nothing_is_wider_than_the_terminal_and_nothing_is_lost(width):
    text = printed(report(table()), width)
    assert max(map(len, text.splitlines())) <= width
    for r in range(3):
        for k in range(len(NUMBERS)):
            assert text.count(f"{r}.{k}23456e-10") == 1


def test_the_rows_of_a_table_that_is_too_wide_are_paragraphs():
    text = printed(report(table()), 60)
    assert text.count("number 7 [J]: ") == 3
    assert "number 7 [J]: " not in printed(report(table()), 300)


def test_long_words_fold_and_numbers_do_not():
    rows = ((Cell("a" * 100), Cell("1.23456789")),)
    text = printed(report(Table("t", "", (WORDS, Head("value", numbers=True)), rows)), 50)
    assert max(map(len, text.splitlines())) <= 50
    assert text.count("a") >= 100
    assert "1.23456789" in text


def test_markup_and_what_steers_a_terminal_are_text():
    hostile = "[bold]x[/bold] :smile: \x1b[31m \u202e \x07"
    made = Table(hostile, hostile, (Head(hostile),), ((Cell(hostile),),), hostile)
    text = printed(report(made, hostile, title=hostile), 300)
    assert not {"\x1b", "\u202e", "\x07"} & set(text)
    assert text.count("[bold]x[/bold] :smile: \\x1b[31m") == 6
