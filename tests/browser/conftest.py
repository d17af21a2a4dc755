"""A real browser with a report open. Its tests are marked `browser` and fail without a browser."""

import shutil

import pytest
from playwright.sync_api import BrowserContext, sync_playwright

from rbstab.report.writers.html import page as html_of

NAMES = ("chromium", "chromium-browser", "google-chrome")

# No graphics card, no background requests, no dialogs at the first start. No sandbox: a container
# does not give the browser the rights to build it.
SWITCHES = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--disable-background-networking",
    "--disable-component-update",
    "--no-first-run",
)


@pytest.fixture(scope="module")
def browser():
    """A running Chromium or Chrome."""
    path = next(filter(None, map(shutil.which, NAMES)), None)
    if path is None:
        pytest.fail(f"the tests of the page need a browser: none of {', '.join(NAMES)} was found")
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=path, args=list(SWITCHES))
        yield chromium
        chromium.close()


@pytest.fixture
def opened(browser, tmp_path):
    """A function that opens a report in a new page; any problem of the page fails the test."""
    problems: list[str] = []
    contexts: list[BrowserContext] = []

    def refuse(dialog):
        problems.append(f"dialog: {dialog.message}")
        dialog.accept()

    def open_page(report, **settings):
        file = tmp_path / f"{len(contexts)}.html"
        file.write_text(html_of(report), encoding="utf-8")
        context = browser.new_context(**{"viewport": {"width": 1200, "height": 900}, **settings})
        contexts.append(context)
        page = context.new_page()
        page.on("pageerror", lambda error: problems.append(f"error: {error}"))
        page.on("dialog", refuse)
        page.on(
            "console",
            lambda message: (
                problems.append(f"{message.type}: {message.text}")
                if message.type in ("error", "warning")
                else None
            ),
        )
        page.on(
            "request",
            lambda request: (
                problems.append(f"request: {request.url[:100]}")
                if not request.url.startswith((file.as_uri(), "data:", "blob:"))
                else None
            ),
        )
        page.goto(file.as_uri())
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert problems == []
