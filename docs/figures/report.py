"""Pictures of report pages in a browser: what is seen first of three reports, and two motions.

`make figures` runs this script. It needs Chromium, like the tests of the page. With names of
pictures as arguments it makes only these: run, five, sweep, motion.
"""

import shutil
import sys
import tempfile
from collections.abc import Callable, Iterable
from io import BytesIO
from pathlib import Path

from click.testing import CliRunner
from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

from rbstab_cli.main import cli

ROOT = Path(__file__).parents[2]
PICTURES = ROOT / "docs" / "pictures"
SCREEN = {"width": 1400, "height": 900}
"""The part of a page that is seen without scrolling, px."""

FIVE = ("case1_permanent", "case2_stiff", "case2_visco_elastic", "case3_embedded", "case1_guarded")
TIME_FRACTION, COLOURS = 0.12, 40
"""The time of the motions as a fraction of the run, and the colours of a picture."""


def run(*arguments: str) -> None:
    """Run a command line of rbstab; end the script if it fails."""
    done = CliRunner().invoke(cli, arguments)
    if done.exit_code:
        sys.exit(done.output)


def report_of(folder: Path, names: Iterable[str]) -> Path:
    """Run configs of the paper, prove, and return the report of all of them."""
    results = []
    for name in names:
        result = folder / f"{name}.h5"
        if not result.exists():
            run("run", str(ROOT / "configs/paper" / f"{name}.yaml"), "-o", str(folder), "-q")
        results.append(str(result))
    page = folder / "report.html"
    run("report", *results, "-o", str(page), "--force")
    return page


def report_of_sweep(folder: Path) -> Path:
    """Sweep five variants with 1,000 members each, and return the report."""
    plan = ROOT / "configs/sweeps/variants.yaml"
    run("sweep", str(plan), "-o", str(folder), "-q")
    page = folder / "sweep.html"
    run("report", str(folder / plan.stem), "-o", str(page))
    return page


def opened(browser: Browser, report: Path) -> Page:
    """Open a report, and wait until its figures are drawn."""
    page = browser.new_page(viewport=SCREEN)  # type: ignore[arg-type]  (a dict of two numbers)
    page.goto(report.as_uri())
    page.wait_for_timeout(1500)
    return page


def first_screen(browser: Browser, report: Path) -> Image.Image:
    """Return a picture of what is seen without scrolling."""
    return Image.open(BytesIO(opened(browser, report).screenshot()))


def motions(browser: Browser, report: Path) -> Image.Image:
    """Return two motions side by side, early in the runs."""
    page = opened(browser, report)
    page.get_by_label("Time", exact=True).evaluate(
        f"e => {{ e.value = {TIME_FRACTION} * e.max; e.dispatchEvent(new Event('input')); }}"
    )
    pictures = []
    for number in (0, 2):
        place = page.locator("#motion .motion").nth(number)
        place.scroll_into_view_if_needed()
        page.wait_for_timeout(1500)
        pictures.append(Image.open(BytesIO(place.screenshot())))
    left, right = pictures
    whole = Image.new(
        "RGB", (left.width + right.width + 12, max(left.height, right.height)), "white"
    )
    whole.paste(left, (0, 0))
    whole.paste(right, (left.width + 12, 0))
    return whole


def main() -> None:
    """Make the reports, open them, and save the pictures."""
    chromium = next(filter(None, map(shutil.which, ("chromium", "google-chrome"))), None)
    if chromium is None:
        sys.exit("the pictures of reports need Chromium. Install it.")
    with tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        folder = Path(name)
        browser = playwright.chromium.launch(
            executable_path=chromium, args=["--no-sandbox", "--disable-gpu"]
        )
        made: dict[str, Callable[[], Image.Image]] = {
            "run": lambda: first_screen(browser, report_of(folder, FIVE[2:3])),
            "five": lambda: first_screen(browser, report_of(folder, FIVE)),
            "sweep": lambda: first_screen(browser, report_of_sweep(folder)),
            "motion": lambda: motions(browser, report_of(folder, FIVE)),
        }
        for chosen in sys.argv[1:] or made:
            picture = made[chosen]().convert("RGB").quantize(COLOURS, Image.Quantize.MAXCOVERAGE)
            picture.save(PICTURES / f"report_{chosen}.png", optimize=True)
        browser.close()


if __name__ == "__main__":
    main()
