"""The tables of the benchmark as Markdown, and the page that holds them."""

import math
import platform
import re
from datetime import UTC, datetime
from pathlib import Path

from benchmarks.peers.driver.environments import ROOT
from benchmarks.peers.driver.rows import CHECKED, TARGETS, Measured, Row

PAGE = ROOT / "docs" / "performance.md"
PLACE = re.compile(r"(<!-- peers -->\n).*?(<!-- end -->)", flags=re.DOTALL)


def write_table(rows: list[Row]) -> None:
    """Replace the tables of the page."""
    text = tables(rows)
    print(text)
    page, places = PLACE.subn(lambda match: match[1] + text + match[2], PAGE.read_text("utf-8"))
    if places != 1:
        raise ValueError(f"{PAGE} has {places} places for the tables (expected 1)")
    PAGE.write_text(page, "utf-8")


def tables(rows: list[Row]) -> str:
    """Return both tables and the line about the machine."""
    day = datetime.now(UTC).date().isoformat()
    versions = sorted({version for row in rows for version in row.versions})
    python = f"Python {platform.python_version()}"
    return "\n".join(
        [
            "Members per second on one core:",
            "",
            *_table(
                ["program", *(f"error at most {short(t, 0)}" for t in TARGETS), "computes besides"],
                [_summary(row) for row in rows],
            ),
            "",
            f"Settings, and the errors of {CHECKED} members:",
            "",
            *_table(
                [
                    "program",
                    *(f"setting, error (at most {short(t, 0)})" for t in TARGETS),
                    "first result after",
                ],
                [_detail(row) for row in rows if not row.failure],
            ),
            "",
            f"Measured on {day}, on {processor()}. {', '.join([python, *versions])}.",
            "",
        ]
    )


def processor() -> str:
    """Return the name of the processor."""
    try:
        text = Path("/proc/cpuinfo").read_text("utf-8")
    except OSError:
        return platform.processor() or platform.machine()
    match = re.search(r"^model name\s*:\s*(.+)$", text, flags=re.MULTILINE)
    return match[1].strip() if match else platform.machine()


def _table(head: list[str], rows: list[list[str]]) -> list[str]:
    lines = [head, ["---"] * len(head), *rows]
    return [f"| {' | '.join(line)} |" for line in lines]


def _summary(row: Row) -> list[str]:
    if row.failure:
        reason = row.failure.replace("|", "\\|").replace("<", "&lt;")
        return [row.peer.title, *[reason] * len(TARGETS), row.peer.besides]
    return [row.peer.title, *map(_rate, row.measured), row.peer.besides]


def _rate(measured: Measured) -> str:
    if measured.setting is None:
        return f"not reached; smallest error {short(measured.error)}"
    return "failed" if math.isnan(measured.rate) else _number(measured.rate)


def _number(value: float) -> str:
    """Return a number with two significant digits, without an exponent."""
    digits = max(0, 1 - math.floor(math.log10(value)))
    return f"{float(f'{value:.1e}'):,.{digits}f}"


def _setting(value: float) -> str:
    """Return a tolerance, or a number of steps."""
    return f"{value:g}" if value >= 1 else short(value, 0)


def short(value: float, digits: int = 1) -> str:
    """Return a number as 1.3e-7, without a zero before the power."""
    return f"{value:.{digits}e}".replace("e-0", "e-")


def _detail(row: Row) -> list[str]:
    name = row.peer.setting
    return [
        row.peer.title,
        *(
            "-"
            if measured.setting is None
            else f"{name} {_setting(measured.setting)}, {short(measured.error)}"
            for measured in row.measured
        ),
        f"{row.first_result:.0f} s" if row.first_result >= 0.5 else "below 1 s",
    ]
