"""A real browser. The tests that need one are marked `browser`; without one they fail."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, sync_playwright
from support.browser import Opened

from rbstab.report.model.document import Report
from rbstab.report.writers.html import page as written

NAMES = ("chromium", "chromium-browser", "google-chrome")

# No graphics card, no network of the browser's own, no questions at the first start; a container
# gives the browser no rights to build its sandbox.
SWITCHES = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--disable-background-networking",
    "--disable-component-update",
    "--no-first-run",
)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    path = next(filter(None, map(shutil.which, NAMES)), None)
    if path is None:
        pytest.fail(f"the tests of the page need a browser: none of {', '.join(NAMES)} is there")
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=path, args=list(SWITCHES))
        yield chromium
        chromium.close()


@pytest.fixture
def opened(browser: Browser, tmp_path: Path) -> Iterator[Opened]:
    """Opens a report as a page of its own; whatever goes wrong in it fails the test at the end."""
    wrong: list[str] = []
    contexts = []

    def open_page(report: Report, **settings: Any) -> Page:
        file = tmp_path / f"{len(contexts)}.html"
        file.write_text(written(report), encoding="utf-8")
        context = browser.new_context(**{"viewport": {"width": 1200, "height": 900}, **settings})
        contexts.append(context)
        page = context.new_page()
        page.on("pageerror", lambda error: wrong.append(f"error: {error}"))
        page.on(
            "dialog", lambda dialog: (wrong.append(f"dialog: {dialog.message}"), dialog.accept())
        )
        page.on(
            "console",
            lambda said: (
                wrong.append(f"{said.type}: {said.text}")
                if said.type in ("error", "warning")
                else None
            ),
        )
        page.on(
            "request",
            lambda request: (
                wrong.append(f"request: {request.url[:100]}")
                if not request.url.startswith((file.as_uri(), "data:", "blob:"))
                else None
            ),
        )
        page.goto(file.as_uri())
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert wrong == []
