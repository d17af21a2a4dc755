"""Protects the pages of PDF reports: they are full, and headings stand with their blocks."""

from dataclasses import replace

import pytest
from report.writers.pdf_reports import FIGURE, X, figure_of, read, report, table_of, text_of

from rbstab.report.model.document import Section
from rbstab.report.model.figure import Axis, Figure, Line, Panel


def test_figures_are_numbered_and_keep_their_captions():
    reader = read(report(*(figure_of(power) for power in range(1, 8))))
    text = text_of(reader)
    assert [text.count(f"Figure {number}. A curve") for number in range(1, 9)] == [1] * 7 + [0]
    for page in reader.pages:
        assert len(page.images) == page.extract_text().count("Figure ")


def tall(rows, number):
    """Return a figure of rows of panels, so that one page holds a few of them."""
    panel = Panel(Axis("x"), Axis("y"), (Line(X, X**number),))
    return Figure(f"f-{number}", f"Curve {number}", (panel,) * rows)


def bottom_of(page):
    """Return the baseline of the lowest text but the page number, mm from the lower edge."""
    found = []

    def visit(text, current, matrix, *_):
        height = (current[5] + matrix[5]) / 72 * 25.4
        if text.strip() and height > 15:
            found.append(height)

    page.extract_text(visitor_text=visit)
    return min(found)


def test_figures_fill_their_pages():
    # Three figures of this height fit on a page, with a quarter of it left in their natural height.
    reader = read(report(*(tall(2, number) for number in range(1, 8))))
    counts = [len(page.images) for page in reader.pages]
    full, *_ = counts
    assert full >= 2
    for page, count in zip(reader.pages, counts, strict=True):
        if page is not reader.pages[-1] and count == full:
            # The margin is 20 mm, and the caption has one line.
            assert bottom_of(page) < 20 + 15


def test_a_heading_stands_on_the_page_of_its_first_figure():
    for lines in range(12, 24, 3):
        sections = (
            Section("a", "Before", ("Line.",) * lines),
            Section("b", "The heading", (FIGURE,)),
        )
        pages = read(replace(report(), sections=sections)).pages
        (page,) = [page for page in pages if "The heading" in page.extract_text()]
        assert "Figure 1." in page.extract_text()
        assert len(page.images) == 1


@pytest.mark.parametrize("rows", [4, 12])
@pytest.mark.parametrize("lines", range(0, 36, 5))
def test_no_page_but_the_last_has_a_large_hole(lines, rows):
    """The text area is 257 mm high; of it a third may be empty, and the last line is 3 mm high."""
    blocks = (*["Line."] * lines, tall(3, 1), "Words.", table_of(3, rows), tall(2, 2))
    sections = (
        Section("a", "First", blocks),
        Section("b", "Second", (table_of(3, 14), tall(3, 3), "More words.", table_of(16, 7))),
    )
    pages = read(replace(report(), sections=sections)).pages
    assert max(map(bottom_of, pages[:-1])) < 20 + 0.35 * 257 + 3


def test_blocks_stay_in_their_order():
    blocks = (tall(2, 1), "Words one.", tall(3, 2), table_of(3, 4), tall(2, 3), "Words two.")
    text = text_of(read(report(*blocks)))
    words = ("Figure 1.", "Words one.", "Figure 2.", "A table", "Figure 3.", "Words two.")
    places = [text.index(word) for word in words]
    assert places == sorted(places)


def test_a_figure_makes_room_for_the_table_below_it():
    """Naturally high, the figures leave less room than the table needs."""
    figures = (tall(2, 1), tall(2, 2))
    for rows in range(1, 9):
        (first, *_) = read(report(*figures, table_of(3, rows))).pages
        text = first.extract_text()
        if "A table" not in text:
            # Without the table they fill the page.
            assert bottom_of(first) < 20 + 15
            break
        assert f"r{rows - 1}-0" in text
    assert rows > 2


@pytest.mark.parametrize(("lines", "is_broken"), [(18, True), (24, False)])
def test_a_table_is_broken_only_if_much_of_the_page_would_be_empty(lines, is_broken):
    """A table of 21 rows is 120 mm high: too high for the rest of either page."""
    pages = read(report(*["Line."] * lines, table_of(3, 21))).pages
    assert len(pages) == 2
    assert ("r0-0" in pages[0].extract_text()) == is_broken
    assert "r20-0" in pages[1].extract_text()


def test_wide_tables_after_figures_leave_no_blank_page():
    pages = read(report(tall(2, 1), table_of(16, 30, width=14), tall(2, 2))).pages
    assert [page.mediabox.width > page.mediabox.height for page in pages] == [False, True, False]
    assert all(len(page.extract_text().split()) > 1 for page in pages)
