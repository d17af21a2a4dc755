"""Protects the maps of sweeps in a real browser: the pointer, a click, missing values, the data."""

import csv
import re
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import expect
from support.browser import PHONE, drawn, point_in
from support.made_sweeps import SPIN, code, write_sweep
from support.pages import report as plain_report
from support.sections import sweep_sections

from rbstab.report.model.document import Report
from rbstab.report.model.figure import (
    Cells,
    Figure,
)
from rbstab.report.writers.series import csv_of

pytestmark = [pytest.mark.browser, pytest.mark.slow]

X, Y = "initial_angular_velocity_0", "initial_angular_velocity_1"
GRID = {f"{SPIN}[0]": {"linspace": [-2, 2, 5]}, f"{SPIN}[1]": {"linspace": [0, 30, 4]}}


def columns(a):
    return {
        "status": np.where((a[X] == 2) & (a[Y] == 30), code("range left"), 0),
        "settling_time": np.where(a[X] == 1, np.nan, 3 + a[X] + 0.01 * a[Y]),
        "final_orientation": np.radians(np.outer(1 + a[Y], [0, 1, 0])),
        "peak_contact_displacement": np.outer(1 + a[X] ** 2 + a[Y] ** 2, [1, -1, 0]),
    }


@pytest.fixture
def sweep(tmp_path):
    """The report of a sweep of 5 by 4 members, with its plan beside it."""
    made = write_sweep(tmp_path / "the sweep" / "members.h5", GRID, columns)
    (made.path.parent / "plan.yaml").write_text("")
    return Report("Maps", "2026-01-02", "rbstab report", sweep_sections(made))


def figure_in(report, name):
    blocks = [block for section in report.sections for block in section.blocks]
    return next(b for b in blocks if isinstance(b, Figure) and b.name == name)


def point_at(box, figure, number, x, y):
    """Return where a place of a map is in the window, in px, after scrolling to its panel.

    Its axes are linear, and the picture of its cells fills the panel.
    """
    (cells,) = [mark for mark in figure.panels[number].marks if isinstance(mark, Cells)]
    picture = box.locator(f".p{number}_group .mark-image image").last
    across, up = (
        (value - centres[0] + step / 2) / (step * len(centres))
        for value, centres, step in ((v, c, c[1] - c[0]) for v, c in ((x, cells.x), (y, cells.y)))
    )
    return point_in(picture, across, up)


def panel_number(figure, title):
    return [panel.title for panel in figure.panels].index(title)


def test_the_pointer_names_both_parameters_the_value_and_the_member(opened, sweep):
    page = opened(sweep)
    figure = figure_in(sweep, "sweep-1-map")
    box = drawn(page, figure.name)
    panel = panel_number(figure, "settling time of v [s]")
    page.mouse.move(*point_at(box, figure, panel, -1, 10))
    # The second parameter changes fastest, four values: member 4 * 1 + 1.
    expect(box.locator(".tip")).to_have_text(
        "initial angular_velocity[0] = -1 rad/s\ninitial angular_velocity[1] = 10 rad/s\n"
        "settling time of v: 2.1 s\nmember 5\nClick: the command that runs it",
        use_inner_text=True,
    )
    # A logarithmic scale shows the value, not its logarithm: 1 + 1 + 400.
    peak = panel_number(figure, "largest |E1|, |E2| or |E3| [m]")
    page.mouse.move(*point_at(box, figure, peak, -1, 20))
    expect(box.locator(".tip")).to_contain_text("largest |E1|, |E2| or |E3|: 402 m")


def test_a_cell_without_a_value_says_why_and_the_legend_too(opened, sweep):
    page = opened(sweep)
    figure = figure_in(sweep, "sweep-1-map")
    box = drawn(page, figure.name)
    panel = panel_number(figure, "settling time of v [s]")
    for x, y, reason in ((1, 0, "still moving"), (2, 30, "left the range")):
        page.mouse.move(*point_at(box, figure, panel, x, y))
        expect(box.locator(".tip")).to_contain_text(f"settling time of v: no value, {reason}")
    words = {
        figure.name: ("no value: still moving, left the range",),
        "sweep-1-first": ("returns", "still moving", "left the range"),
    }
    for name, entries in words.items():
        legend = page.locator(f"[id='figure.{name}'] .legend")
        for word in entries:
            expect(legend.get_by_text(word, exact=True)).to_be_visible()


CLIPBOARD = pytest.mark.parametrize("is_allowed", [True, False], ids=["copied", "shown"])


@pytest.fixture
def page(opened, sweep, is_allowed):
    """The page of the sweep; some browsers have no clipboard on a page from a disk."""
    page = opened(sweep, permissions=["clipboard-read", "clipboard-write"] if is_allowed else [])
    if not is_allowed:
        page.evaluate("Object.defineProperty(navigator, 'clipboard', { value: undefined })")
    return page


@CLIPBOARD
def test_a_click_shows_the_command_of_the_member(page, sweep, tmp_path, is_allowed):
    figure = figure_in(sweep, "sweep-1-map")
    box = drawn(page, figure.name)
    place = point_at(box, figure, panel_number(figure, "settling time of v [s]"), 0, 20)
    page.mouse.move(*place)
    page.mouse.click(*place)
    note = page.locator(f"[id='figure.{figure.name}'] .chosen")
    command = f"rbstab run '{tmp_path / 'the sweep' / 'plan.yaml'}' --member 10"
    expect(note.locator("code")).to_have_text(command)
    expect(note).to_contain_text("Member 10")
    expect(note.locator("small")).to_have_text("copied" if is_allowed else "")
    if is_allowed:
        assert page.evaluate("navigator.clipboard.readText()") == command
    # The figure may be higher than the window: the foot of the window has it too, for some seconds.
    brief = page.locator(".brief")
    expect(brief).to_have_text(f"Member 10{', copied' if is_allowed else ''}: {command}")
    expect(brief).to_be_in_viewport(ratio=1.0)
    expect(brief).to_have_attribute("aria-hidden", "true")
    # Another click replaces it.
    place = point_at(box, figure, 0, -2, 0)
    page.mouse.move(*place)
    page.mouse.click(*place)
    expect(page.locator(".chosen")).to_have_count(1)
    expect(note).to_contain_text("--member 0")


@CLIPBOARD
def test_a_button_copies_the_command_of_a_notable_member(page, tmp_path, is_allowed):
    row = page.locator("[id='table.sweep-1-notable'] tbody tr").nth(1)
    member = row.get_by_role("rowheader").get_attribute("data-value")
    assert member is not None
    row.get_by_role("button").click()
    command = f"rbstab run '{tmp_path / 'the sweep' / 'plan.yaml'}' --member {float(member):.0f}"
    brief = page.locator(".brief")
    expect(brief).to_have_text(f"Copied: {command}" if is_allowed else command)
    expect(brief).to_be_in_viewport(ratio=1.0)
    if is_allowed:
        assert page.evaluate("navigator.clipboard.readText()") == command


def test_a_tap_on_a_phone_shows_the_command(opened, sweep):
    page = opened(sweep, **PHONE)
    box = drawn(page, "sweep-1-first")
    page.touchscreen.tap(*point_at(box, figure_in(sweep, "sweep-1-first"), 0, -1, 20))
    expect(page.locator(".chosen code")).to_have_text(re.compile("--member 6$"))
    assert page.evaluate("document.documentElement.scrollWidth") <= 390


def downloaded(page, name):
    """Click the CSV button of a figure, and return the rows of the file."""
    with page.expect_download() as waiting:
        page.locator(f"[id='figure.{name}']").get_by_role("button", name="CSV").click()
    assert waiting.value.suggested_filename == f"{name}.csv"
    return list(csv.reader(StringIO(Path(waiting.value.path()).read_text(encoding="utf-8"))))


def same(entry, other):
    """Return whether two entries are the same text, or the same number in single precision."""
    try:
        return bool(np.isclose(float(entry), float(other), rtol=1e-5, atol=1e-12, equal_nan=True))
    except ValueError:
        return entry == other


@pytest.mark.parametrize("name", ["over-time", "maps", "counts"])
def test_the_button_gives_the_data_of_any_figure(opened, name):
    report = plain_report()
    page = opened(report)
    rows = downloaded(page, name)
    expected = list(csv.reader(StringIO(csv_of(figure_in(report, name)))))
    assert rows[0] == expected[0]
    # Points that a screen cannot show are not on a page, and traces come in another order.
    missing = [row for row in rows if not any(all(map(same, row, other)) for other in expected)]
    assert missing == []
    kinds = {(row[0], row[3]) for row in expected}
    assert {(row[0], row[3]) for row in rows} == kinds


def test_the_data_of_maps_is_whole(opened, sweep):
    page = opened(sweep)
    name = "sweep-1-map"
    rows = downloaded(page, name)
    expected = list(csv.reader(StringIO(csv_of(figure_in(sweep, name)))))
    assert len(rows) == len(expected)
    for line, other in zip(sorted(rows), sorted(expected), strict=True):
        assert line[:4] == other[:4]
    cells = [row for row in rows if row[0] == "settling time of v [s]" and row[8]]
    values = {(float(row[4]), float(row[5])): float(row[8]) for row in cells}
    assert len(values) == 20
    assert values[-1, 10] == pytest.approx(2.1)
    assert np.isnan(values[1, 0])
    outcomes = downloaded(page, "sweep-1-first")
    words = {row[8] for row in outcomes if row[0] == "outcome"}
    assert words == {"returns", "still moving", "left the range"}
