"""Picture of the README: the top of the report of the paper's cases, in a browser.

`make figures` runs this script. It needs Chromium, like the tests of the page.
"""

import shutil
import sys
import tempfile
from io import BytesIO
from pathlib import Path

from click.testing import CliRunner
from PIL import Image
from playwright.sync_api import Page, sync_playwright

from rbstab_cli.main import cli

ROOT = Path(__file__).parents[2]
PICTURE = Path(__file__).with_name("report.png")
WIDTH, TIME_FRACTION = 1240, 0.12
"""Width of the page in pixels, and the time of the pictures as a fraction of the run."""


def make_report(folder: Path) -> Path:
    """Make the report of the paper's cases and return its path."""
    cases = sorted(str(path) for path in (ROOT / "configs/paper").glob("*.yaml"))
    run(["run", *cases, "-o", str(folder)])
    results = sorted(str(path) for path in folder.glob("*.h5"))
    run(
        ["report", *results, "-o", str(folder / "report.html"), "--title", "The cases of the paper"]
    )
    return folder / "report.html"


def run(arguments: list[str]) -> None:
    """Run a command line of rbstab; end the script if it fails."""
    done = CliRunner().invoke(cli, arguments)
    if done.exit_code:
        sys.exit(done.output)


def screenshots(page: Page) -> list[bytes]:
    """Take pictures of the page: summary, two motions, curves."""
    page.get_by_label("Time", exact=True).evaluate(
        f"e => {{ e.value = {TIME_FRACTION} * e.max; e.dispatchEvent(new Event('input')); }}"
    )
    pictures = []
    for part in (
        "#summary .table",
        "#motion .motion >> nth=0",
        "#motion .motion >> nth=2",
        ".plot",
    ):
        place = page.locator(part).first
        place.scroll_into_view_if_needed()
        page.wait_for_timeout(1500)
        pictures.append(place.screenshot())
    return pictures


def main() -> None:
    """Make the report, open it, and save one picture of its parts."""
    chromium = next(filter(None, map(shutil.which, ("chromium", "google-chrome"))), None)
    if chromium is None:
        sys.exit("the picture of the report needs Chromium. Install it.")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        report = make_report(Path(folder))
        browser = playwright.chromium.launch(
            executable_path=chromium, args=["--no-sandbox", "--disable-gpu"]
        )
        page = browser.new_page(viewport={"width": WIDTH, "height": 1500})
        page.goto(report.as_uri())
        page.wait_for_timeout(1500)
        summary, *others = (Image.open(BytesIO(shot)) for shot in screenshots(page))
        browser.close()
    save(summary, *others)


def save(summary: Image.Image, left: Image.Image, right: Image.Image, curves: Image.Image) -> None:
    """Save a picture: summary above, two motions side by side, curves below.

    It has 128 colours, which keeps the file small.
    """
    width = max(summary.width, left.width + right.width + 12, curves.width)
    heights = [summary.height, max(left.height, right.height), curves.height]
    whole = Image.new("RGB", (width + 32, sum(heights) + 64), "white")
    whole.paste(summary, (16, 16))
    whole.paste(left, (16, 32 + heights[0]))
    whole.paste(right, (16 + left.width + 12, 32 + heights[0]))
    whole.paste(curves, (16, 48 + heights[0] + heights[1]))
    whole.quantize(128).save(PICTURE, optimize=True)


if __name__ == "__main__":
    main()
