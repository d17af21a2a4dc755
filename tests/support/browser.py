"""What the tests of pages in a real browser have in common."""

from playwright.sync_api import expect

PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}


def drawn(page, name):
    """Scroll to a figure, wait until it is drawn, and return it."""
    box = page.locator(f".drawing[data-name='{name}']")
    box.scroll_into_view_if_needed()
    expect(box.locator("svg.marks")).to_be_visible()
    return box


def point_in(place, across, up):
    """Return a point in an element, in px of the window, by its shares of the width and height."""
    place.scroll_into_view_if_needed()
    box = place.bounding_box()
    assert box is not None
    return box["x"] + across * box["width"], box["y"] + (1 - up) * box["height"]


def point_to(box, panel, across=0.5):
    """Move the pointer to half the height of a panel of a figure."""
    background = box.locator(f".p{panel}_group path.background").first
    box.page.mouse.move(*point_in(background, across, 0.5))
