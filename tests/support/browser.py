"""The type of the fixture `opened` of the browser tests."""

from collections.abc import Callable

from playwright.sync_api import Page

Opened = Callable[..., Page]
"""Open a report as a page, with options of the browser context."""
