"""Protects the HTML page of a report in a real browser: figures, tables, motions, themes, print."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import expect
from support.browser import PHONE, drawn, point_to
from support.pages import END, hostile_report, report

from rbstab.report.model.document import Section
from rbstab.report.model.figure import Axis, Figure, Line, Panel

pytestmark = [pytest.mark.browser, pytest.mark.slow]


@pytest.fixture
def page(opened):
    """The page of a report with a block of every kind."""
    return opened(report())


def curves(box):
    """Return the opacities of the curves and areas of a figure, panel by panel."""
    paths = box.locator(".mark-line.role-mark path, .mark-area.role-mark path")
    return [path.get_attribute("opacity") for path in paths.all()]


def ticks(box, panel):
    """Return the numbers at the horizontal axis of a panel, ascending."""
    texts = box.locator(f".p{panel}_group .role-axis .role-axis-label").first.locator("text")
    return sorted(float(text.replace("−", "-")) for text in texts.all_text_contents() if text)


def names(page):
    return page.locator("tbody th a").all_inner_texts()


def test_every_figure_is_drawn(page):
    for name, panels in (("over-time", 3), ("maps", 2), ("counts", 3)):
        box = drawn(page, name)
        for number in range(panels):
            expect(box.locator(f".p{number}_group").first).to_be_attached()
    maps = page.locator(".drawing[data-name='maps'] .mark-image image")
    addresses = [image.get_attribute("href") or "" for image in maps.all()]
    assert len([address for address in addresses if address.startswith("data:image/")]) == 4


def test_a_table_is_sorted_by_values_with_the_mouse(page):
    head = page.locator("thead th").nth(1)
    assert names(page) == ["beta", "alpha", "gamma"]
    # The values are 10, 9 and NaN; sorted as texts, 10 would come before 9.
    for order, expected in (
        ("ascending", ["alpha", "beta", "gamma"]),
        ("descending", ["beta", "alpha", "gamma"]),
        ("none", ["beta", "alpha", "gamma"]),
    ):
        head.locator("button").click()
        assert head.get_attribute("aria-sort") == order
        assert names(page) == expected


def test_the_legend_hides_and_shows_all_curves_of_a_name(page):
    box = drawn(page, "over-time")
    legend = page.locator("[id='figure.over-time'] .legend")
    assert legend.locator("button").all_inner_texts() == ["first", "second", "bound", "one", "two"]
    first = legend.get_by_role("button", name="first")
    whole = curves(box)
    assert "0" not in whole
    first.click()
    assert first.get_attribute("aria-pressed") == "false"
    # The name "first" has a curve in two of the panels.
    expect(box.locator(".mark-line.role-mark path[opacity='0']")).to_have_count(2)
    first.click()
    expect(box.locator(".mark-line.role-mark path[opacity='0']")).to_have_count(0)
    assert curves(box) == whole


def test_a_figure_offers_a_picture_and_to_send_nothing(opened):
    page = opened(report(), color_scheme="dark")
    drawn(page, "over-time")
    tools = page.locator("[id='figure.over-time'] .tools button")
    assert tools.all_inner_texts() == ["+", "−", "1:1", "SVG", "CSV"]
    with page.expect_download() as waiting:
        tools.nth(3).click()
    assert waiting.value.suggested_filename == "over-time.svg"
    picture = Path(waiting.value.path()).read_text(encoding="utf-8")
    assert picture.startswith("<svg")
    # On white, also from a dark page, and with the names of the curves.
    assert 'fill="#ffffff"' in picture
    assert ">second<" in picture


def pose(page, name):
    """Return the shown positions of the centre of gravity and of the contact point."""
    text = page.locator(f"canvas[data-name='{name}']").get_attribute("data-pose")
    assert text is not None
    return [float(number) for number in text.split()]


def test_the_slider_moves_all_bodies_and_the_cursors(page):
    box = drawn(page, "over-time")
    slider = page.get_by_label("Time", exact=True)
    cursor = box.locator(".p0_group .mark-rule.role-mark line").last

    def place():
        box.scroll_into_view_if_needed()
        page.wait_for_timeout(100)
        left: float = cursor.evaluate("e => e.getBoundingClientRect().left")
        return left

    begin = place()
    page.locator("canvas").first.scroll_into_view_if_needed()
    slider.evaluate("e => { e.value = e.max / 2; e.dispatchEvent(new Event('input')); }")
    # Half of the way along x, and a quarter turn about z, which takes R from x to y.
    for name in ("run-1", "run-2"):
        expect(page.locator(f"canvas[data-name='{name}']")).to_have_attribute(
            "data-pose", re.compile("^1.0000 ")
        )
        assert pose(page, name) == pytest.approx([END / 2, 0, 0, END / 2, 0.1, -0.4], abs=1e-3)
    middle = place()
    page.locator("canvas").first.scroll_into_view_if_needed()
    slider.focus()
    page.keyboard.press("End")
    end = place()
    assert middle - begin == pytest.approx(end - middle, abs=2)
    assert end - begin > 200
    page.locator("canvas").first.scroll_into_view_if_needed()
    slider.focus()
    page.keyboard.press("ArrowLeft")
    assert 0.99 * END < pose(page, "run-1")[0] < END


def test_a_click_on_a_curve_sets_the_time(page):
    point_to(drawn(page, "over-time"), 0, 0.25)
    page.mouse.down()
    page.mouse.up()
    slider = page.get_by_label("Time", exact=True)
    expect(slider).not_to_have_value("0")
    assert float(slider.input_value()) == pytest.approx(END / 4, abs=0.06)


def test_a_zoom_holds_in_all_panels_and_in_other_colours(page):
    box = drawn(page, "over-time")
    assert ticks(box, 0)[-1] == END
    page.locator("[id='figure.over-time'] .tools button", has_text="+").click()
    page.wait_for_timeout(100)
    for change in ("zoomed", "theme"):
        if change == "theme":
            page.locator(".theme").click()
        for panel in range(3):
            shown = ticks(box, panel)
            assert END / 4 <= shown[0] < shown[-1] <= 3 * END / 4
    page.locator("[id='figure.over-time'] .tools button", has_text="1:1").click()
    page.wait_for_timeout(100)
    assert ticks(box, 2)[-1] == END


def test_the_wheel_zooms_with_ctrl_and_scrolls_without(page):
    box = drawn(page, "over-time")
    point_to(box, 0)
    before = ticks(box, 0)
    page.mouse.wheel(0, 50)
    page.wait_for_timeout(200)
    assert ticks(box, 0) == before
    page.mouse.wheel(0, -50)
    page.wait_for_timeout(200)
    page.keyboard.down("Control")
    page.mouse.wheel(0, -400)
    page.keyboard.up("Control")
    page.wait_for_timeout(300)
    assert ticks(box, 0)[-1] < END


def test_the_pointer_reads_the_curves(page):
    box = drawn(page, "over-time")
    point_to(box, 0)
    lines = box.locator(".tip").inner_text().split("\n")
    values = dict(line.removesuffix(" m").split(" = ") for line in lines[1:])
    time = float(lines[0].split(" = ")[1].removesuffix(" s"))
    assert time == pytest.approx(END / 2, abs=0.01)
    assert float(values["first"]) == pytest.approx(np.sin(time), abs=1e-3)
    assert float(values["second"]) == pytest.approx(np.cos(time), abs=1e-3)


def test_the_pointer_says_nothing_false_of_a_curve(opened):
    """On logarithmic axes a straight line is a power law; an orbit has no one value at a place."""
    turn = np.linspace(0, 2 * np.pi, 41)
    square = Axis("x", ends=(-2.0, 2.0))
    panels = (
        Panel(square, Axis("y", log=True), (Line(np.array([-2.0, 2.0]), np.array([1.0, 1e-4])),)),
        Panel(square, square, (Line(np.cos(turn), np.sin(turn), "orbit"),)),
    )
    figure = Figure("made", "Made", panels, columns=2)
    page = opened(replace(report(), sections=(Section("made", "Made", (figure,)),)))
    box = drawn(page, "made")
    tips = []
    for panel in (0, 1):
        point_to(box, panel)
        page.wait_for_timeout(50)
        tip = box.locator(".tip")
        tips.append(tip.inner_text().partition("y = ")[2] if tip.is_visible() else "")
    # In the middle between 1 and 1e-4, up to a pixel; on a linear axis it would be 0.5.
    assert float(tips[0]) == pytest.approx(0.01, rel=0.03)
    assert tips[1] == ""


def test_play_and_pause(opened):
    page = opened(report(), reduced_motion="reduce")
    slider = page.get_by_label("Time", exact=True)
    assert float(slider.input_value()) == 0
    page.get_by_role("button", name="Play").click()
    expect(slider).not_to_have_value("0")
    page.get_by_role("button", name="Pause").click()
    reached = slider.input_value()
    page.wait_for_timeout(200)
    assert slider.input_value() == reached


def test_a_view_turns_by_dragging_and_by_keys(page):
    canvas = page.locator("canvas").first
    canvas.scroll_into_view_if_needed()
    looks = [canvas.screenshot()]
    box = canvas.bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 80, y)
    page.mouse.up()
    looks.append(canvas.screenshot())
    canvas.focus()
    page.keyboard.press("ArrowUp")
    looks.append(canvas.screenshot())
    page.keyboard.press("+")
    looks.append(canvas.screenshot())
    assert len(set(looks)) == 4


def test_nothing_is_wider_than_a_telephone(opened):
    page = opened(report(), **PHONE)
    for name in ("over-time", "maps", "counts"):
        drawn(page, name)
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    # The table has room for some of its columns. All of them scroll in their own box, which the
    # keyboard can focus.
    box, columns = page.locator(".scroll"), page.locator("thead th:visible")
    assert box.evaluate("e => e.scrollWidth <= e.clientWidth && e.tabIndex === 0")
    total, first = page.locator("thead th").count(), columns.count()
    assert 2 <= first < total
    button, bar = page.locator(".columns button"), page.locator(".columns")
    expect(button).to_have_text(f"Show all {total} columns")
    expect(bar).not_to_contain_text("Scroll")
    button.click()
    expect(columns).to_have_count(total)
    assert box.evaluate("e => e.scrollWidth > e.clientWidth")
    expect(bar).to_contain_text("Scroll sideways to see all columns.")
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    button.click()
    expect(columns).to_have_count(first)


def luminance(page, selector, what):
    colour = page.locator(selector).first.evaluate(f"e => getComputedStyle(e).{what}")
    return sum(map(float, re.findall(r"[\d.]+", colour)[:3])) / 3


def test_dark_pages_have_light_texts_also_in_figures(opened):
    page = opened(report(), color_scheme="dark")
    drawn(page, "over-time")
    for theme, low, high in (("dark", 0, 60), ("light", 200, 255)):
        assert low <= luminance(page, "body", "backgroundColor") <= high, theme
        texts = luminance(page, ".drawing .role-axis-label text", "fill")
        assert (texts > 180) if theme == "dark" else (texts < 80)
        grid = luminance(page, ".drawing .role-axis-grid line", "stroke")
        assert (grid < 80) if theme == "dark" else (grid > 180)
        page.locator(".theme").click()


def test_on_paper_everything_is_there_and_light(opened, tmp_path):
    page = opened(report(), color_scheme="dark")
    # The page draws its figures one after the other, also those far from the view.
    expect(page.locator(".drawing svg.marks")).to_have_count(3)
    page.pdf(path=tmp_path / "page.pdf", format="A4")
    assert (tmp_path / "page.pdf").read_bytes().startswith(b"%PDF")
    page.emulate_media(media="print")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert luminance(page, ".drawing .role-axis-label text", "fill") < 80


def test_hostile_texts_are_texts(opened):
    page = opened(hostile_report())
    box = drawn(page, "figure")
    page.locator("canvas").scroll_into_view_if_needed()
    assert page.locator("img, b, main script").count() == 0
    assert page.locator("h1").inner_text().startswith("</script><script>alert(1)")
    shown = [text.replace("\u00a0", " ") for text in box.locator("text").all_text_contents()]
    assert any("<b>bold</b> &lt;" in text for text in shown)
    legend = page.locator("[id='figure.figure'] .legend button")
    assert legend.count() == 1
    assert "<img src=x onerror=alert(2)>" in legend.inner_text()


def test_without_scripts_the_tables_are_there_and_figures_say_why_not(opened):
    page = opened(report(), java_script_enabled=False)
    assert page.locator("tbody tr").count() == 3
    assert page.get_by_text("This figure needs JavaScript.").count() == 3
    assert page.locator(".clock").is_hidden()
