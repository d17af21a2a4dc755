"""Protects the page at the widths of a desktop and of a phone: cards, tables, details that fold."""

import re
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import expect
from support.browser import Opened
from support.made_sweeps import SPIN, write_sweep
from support.sections import sweep_sections

from rbstab.report.model.document import Cell, Head, Report, Section, Table
from rbstab.report.model.figure import Axis, Cells, Figure, Line, Panel, Points

pytestmark = [pytest.mark.browser, pytest.mark.slow]

DESKTOP = {"viewport": {"width": 1400, "height": 900}}
PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
WIDTHS = pytest.mark.parametrize("size", [DESKTOP, PHONE], ids=["desktop", "phone"])


@pytest.fixture
def compared(tmp_path: Path) -> Report:
    """The report of a sweep of three variants over three parameters."""
    vary = {
        "controller.variant": {"each": {"values": ["free", "permanent", "visco-elastic"]}},
        "body.mass": {"uniform": [20, 60]},
        f"{SPIN}[0]": {"normal": [0, 1]},
        f"{SPIN}[1]": {"normal": [0, 1]},
    }

    def columns(a):
        slow = 1 + 0.01 * a["body_mass"] + 0.3 * a["controller_variant"]
        return {"settling_time": slow, "smallest_regularity": 0.9 - 0.1 * slow}

    design = {"design": "random", "members": 400, "seed": 1}
    made = write_sweep(
        tmp_path / "a_sweep_with_a_rather_long_name" / "members.h5", vary, columns, **design
    )
    return Report("Widths", "2026-01-02", "rbstab report", sweep_sections(made))


@WIDTHS
def test_the_page_never_scrolls_sideways(opened: Opened, compared: Report, size: dict) -> None:
    page = opened(compared, **size)
    for box in page.locator(".drawing").all():
        box.scroll_into_view_if_needed()
        expect(box.locator("svg.marks").first).to_be_visible()
    width = size["viewport"]["width"]
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    for kind in (".card", ".scroll", ".plot"):
        for element in page.locator(kind).all():
            place = element.bounding_box()
            # A folded section has no box.
            assert place is None or (place["x"] >= 0 and place["x"] + place["width"] <= width)


@WIDTHS
def test_the_answers_are_seen_first(opened: Opened, compared: Report, size: dict) -> None:
    page = opened(compared, **size)
    section = page.locator("main > section").first
    expect(section.locator("p").first).to_contain_text("Returns: 1200 of 1200 members.")
    expect(section.locator("p").first).to_be_in_viewport()
    # Which condition is better, and the first figure.
    expect(section.locator("p").nth(2)).to_be_in_viewport()
    if size is DESKTOP:
        expect(section.locator(".drawing").first).to_be_in_viewport()


@WIDTHS
def test_the_first_columns_of_a_table_are_seen(
    opened: Opened, compared: Report, size: dict
) -> None:
    page = opened(compared, **size)
    for box in page.locator(".scroll").all():
        if not box.is_visible():
            continue
        inside = box.evaluate(
            """(box) => {
                const heads = [...box.querySelector("thead tr").cells].slice(0, 2);
                const { right } = box.getBoundingClientRect();
                return heads[0].getBoundingClientRect().right <= right
                    && heads[1].getBoundingClientRect().left < right;
            }"""
        )
        assert inside


@WIDTHS
def test_details_are_folded_until_they_are_opened(
    opened: Opened, compared: Report, size: dict
) -> None:
    page = opened(compared, **size)
    section = page.locator("section[id$='-plan']")
    table = section.locator("table").first
    expect(table).to_be_hidden()
    section.locator("summary").click()
    expect(table).to_be_visible()
    section.locator("summary").focus()
    page.keyboard.press("Enter")
    expect(table).to_be_hidden()
    # What decides is not folded.
    expect(page.locator("main > section").first.locator("details")).to_have_count(0)


@WIDTHS
def test_titles_do_not_cover_tick_labels(opened: Opened, compared: Report, size: dict) -> None:
    page = opened(compared, **size)
    for box in page.locator(".drawing").all():
        box.scroll_into_view_if_needed()
        expect(box.locator("svg.marks").first).to_be_visible()
        covered = box.evaluate(
            """(box) => {
                const place = (e) => e.getBoundingClientRect();
                const titles = [...box.querySelectorAll(".role-axis-title text, .role-title text")]
                    .filter((e) => e.textContent).map(place);
                const ticks = [...box.querySelectorAll(".role-axis-label text")]
                    .filter((e) => e.textContent && e.getAttribute("opacity") !== "0").map(place);
                const covers = (a, b) => a.left < b.right - 1 && b.left < a.right - 1
                    && a.top < b.bottom - 1 && b.top < a.bottom - 1;
                return titles.filter((a) => ticks.some((b) => covers(a, b))).length;
            }"""
        )
        assert covered == 0, box.get_attribute("data-name")


def test_rows_that_are_empty_in_the_shown_columns_are_hidden(opened: Opened) -> None:
    """The last rows of a matrix of pairs have values in its last columns only."""
    names = [f"a condition with a long name {k}" for k in range(5)]
    heads = (Head("row minus column"), *(Head(name, numbers=True) for name in names[1:]))
    rows = [
        (Cell(name), *[Cell("")] * k, *(Cell(f"{k}{j}", float(j)) for j in range(k, 4)))
        for k, name in enumerate(names[:-1])
    ]
    table = Table("t-matrix", "Matrix", heads, tuple(rows))
    section = Section("facts", "Facts", (table,))
    page = opened(Report("Facts", "2026-01-02", "rbstab report", (section,)), **PHONE)
    button = page.locator(".columns button")
    expect(button).to_have_text("Show all 5 columns")
    shown = page.locator("tbody tr:visible")
    last = page.locator("thead th:visible").count() - 1
    assert 0 < last < 4
    expect(shown).to_have_count(last)
    assert all(row.locator("td:visible").last.inner_text() for row in shown.all())
    button.click()
    expect(shown).to_have_count(4)


def test_a_digest_does_not_push_its_table_beyond_the_edge_of_a_phone(opened: Opened) -> None:
    facts = Table(
        "t", "Facts", (Head("property"), Head("value")), ((Cell("digest"), Cell("0a1b2c3d" * 8)),)
    )
    section = Section("facts", "Facts", (facts,))
    page = opened(Report("Facts", "2026-01-02", "rbstab report", (section,)), **PHONE)
    assert page.locator(".scroll").evaluate("box => box.scrollWidth <= box.clientWidth + 1")


def test_sentences_in_a_table_are_seen_whole_on_a_phone(opened: Opened) -> None:
    """A table of facts, folded: its sentences break, and the mark that unfolds it is seen."""
    sentence = "the rest state that the motion approaches; proved to be the only one in the range"
    facts = Table(
        "t", "Facts", (Head("property"), Head("value")), ((Cell("lyapunov zero"), Cell(sentence)),)
    )
    section = Section("facts", "Facts", (facts,), folded=True)
    page = opened(Report("Facts", "2026-01-02", "rbstab report", (section,)), **PHONE)
    summary = page.locator("summary", has_text="Facts")
    assert summary.evaluate("e => getComputedStyle(e).listStylePosition") == "inside"
    summary.click()
    box = page.locator(".scroll")
    expect(box).to_be_visible()
    assert box.evaluate("e => e.scrollWidth <= e.clientWidth + 1")


def test_the_notice_is_legible_on_a_dark_page_without_scripts(
    opened: Opened, compared: Report
) -> None:
    page = opened(compared, java_script_enabled=False, color_scheme="dark")
    notice = page.locator(".notice").first
    expect(notice).to_be_visible()
    colours = notice.evaluate(
        "e => [getComputedStyle(e).color, getComputedStyle(e).backgroundColor]"
    )
    # The ratio of the Web Content Accessibility Guidelines for text, level AA.
    assert contrast(*colours) >= 4.5


def contrast(one: str, other: str) -> float:
    """Return the contrast ratio of two colours, as WCAG 2 defines it."""

    def luminance(colour: str) -> float:
        parts = [int(part) / 255 for part in re.findall(r"\d+", colour)[:3]]
        linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
        return sum(w * p for w, p in zip((0.2126, 0.7152, 0.0722), linear, strict=True))

    high, low = sorted((luminance(one), luminance(other)), reverse=True)
    return (high + 0.05) / (low + 0.05)


def test_labels_of_categories_do_not_cover_each_other_on_a_phone(opened: Opened) -> None:
    labels = ("completed", "completed, settled", "completed, |E| below 1 mm", "proved to converge")
    points = Points(np.arange(4.0), np.ones(4))
    panel = Panel(Axis("outcome", categories=labels), Axis("share"), (points,))
    section = Section("s", "Section", (Figure("f", "Figure", (panel,)),))
    page = opened(Report("Figure", "2026-01-02", "rbstab report", (section,)), **PHONE)
    box = page.locator(".drawing")
    box.scroll_into_view_if_needed()
    axis = box.locator(".role-axis").filter(has_text="completed").first
    expect(axis).to_be_visible()
    places = [text.bounding_box() for text in axis.locator(".role-axis-label text").all()]
    assert len(places) == 4
    # They are turned: each is narrower than the distance from one to the next.
    lefts = sorted(place["x"] for place in places if place is not None)
    assert min(np.diff(lefts)) > 10


def test_the_mark_of_a_folded_section_stands_beside_its_heading_on_a_phone(
    opened: Opened, compared: Report
) -> None:
    page = opened(compared, **PHONE)
    summary = page.locator("section[id$='-plan'] summary")
    # A heading on the line below the mark would begin at the left edge.
    assert summary.evaluate(
        """(e) => {
            const left = (one) => one.getClientRects()[0].left;
            return left(e.querySelector("h2")) > left(e) + 5;
        }"""
    )


@pytest.mark.parametrize("width", [1400, 390])
def test_nothing_below_a_figure_moves_much_when_it_is_drawn(opened: Opened, width: int) -> None:
    middles = np.arange(2.0)
    title = "a title of a panel that is as long as the panel is wide"
    maps = tuple(
        Panel(Axis("x"), Axis("y"), (Cells(middles, middles, np.eye(2), Axis("z"), (0, 1)),), title)
        for _ in range(2)
    )
    plain = Panel(Axis("x"), Axis("y"), (Line(middles, middles),))
    figures = (
        Figure("by-condition", "F", maps, columns=2, shared="xy"),
        Figure("curves", "F", (plain,) * 4, columns=2),
    )
    section = Section("s", "S", figures)
    page = opened(
        Report("R", "2026-01-02", "rbstab report", (section,)),
        viewport={"width": width, "height": 900},
    )
    for box in page.locator(".drawing").all():
        box.scroll_into_view_if_needed()
        expect(box.locator("svg.marks").first).to_be_visible()
        assert box.evaluate("box => box.clientHeight - parseFloat(box.style.minHeight)") < 90
