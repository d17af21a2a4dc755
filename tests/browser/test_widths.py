"""Protects the page at the widths of a desktop and of a phone: cards, tables, details that fold."""

import pytest
from playwright.sync_api import expect
from support.browser import PHONE
from support.made_runs import made_file
from support.made_sweeps import SPIN, write_sweep
from support.sections import sweep_sections

from rbstab.report.build import report_of
from rbstab.report.model.document import Cell, Head, Report, Section, Table
from rbstab.report.reading.sources import read_sources

pytestmark = [pytest.mark.browser, pytest.mark.slow]

DESKTOP = {"viewport": {"width": 1400, "height": 900}}
WIDTHS = pytest.mark.parametrize("size", [DESKTOP, PHONE], ids=["desktop", "phone"])


@pytest.fixture
def compared(tmp_path):
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


@pytest.fixture
def runs(tmp_path):
    """The report of five runs, one of which ended early."""
    status = {"e": "range left"}
    paths = [
        made_file(tmp_path / f"{name}.h5", status=status.get(name, "completed")) for name in "abcde"
    ]
    return report_of(read_sources(paths), "rbstab report")


@WIDTHS
@pytest.mark.parametrize("kind", ["compared", "runs"])
def test_the_page_never_scrolls_sideways(opened, kind, size, request):
    page = opened(request.getfixturevalue(kind), **size)
    assert kind != "runs" or 3 < page.locator(".drawing").count() <= 6
    for box in page.locator(".drawing").all():
        box.scroll_into_view_if_needed()
        expect(box.locator("svg.marks").first).to_be_visible()
    width = size["viewport"]["width"]
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    for selector in (".card", ".scroll", ".plot"):
        for element in page.locator(selector).all():
            place = element.bounding_box()
            # A folded section has no box.
            assert place is None or (place["x"] >= 0 and place["x"] + place["width"] <= width)


@WIDTHS
def test_the_answers_are_seen_first(opened, compared, size):
    page = opened(compared, **size)
    section = page.locator("main > section").first
    expect(section.locator("p").first).to_contain_text("Returns: 1200 of 1200 members.")
    expect(section.locator("p").first).to_be_in_viewport()
    # Which condition is better, and the first figure.
    expect(section.locator("p").nth(2)).to_be_in_viewport()
    if size is DESKTOP:
        expect(section.locator(".drawing").first).to_be_in_viewport()


@WIDTHS
def test_the_answers_of_runs_are_seen_first(opened, runs, size):
    page = opened(runs, **size)
    card = page.locator(".card").first
    word = card.locator(".word").first
    expect(word).to_be_in_viewport()
    for line in card.locator("dt, dd, h3").all():
        assert line.evaluate("e => e.scrollWidth <= e.clientWidth + 1")


@WIDTHS
def test_the_first_columns_of_a_table_are_seen(opened, compared, size):
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
def test_details_are_folded_until_they_are_opened(opened, compared, size):
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


def test_sentences_in_a_table_are_seen_whole_on_a_phone(opened):
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
