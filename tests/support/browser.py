"""What the fixture `opened` of the tests in a browser is."""

from collections.abc import Callable

from playwright.sync_api import Page

Opened = Callable[..., Page]
"""Opens a report as a page, with settings of the browser."""
