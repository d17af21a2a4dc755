"""Counts of 10,000 members and more have separators; what is typed or read by programs has none."""

import re

import numpy as np
from support.made_sweeps import SPIN, code, write_sweep

from rbstab.report.build import report_of
from rbstab.report.model.document import Table
from rbstab.report.reading.sources import read_sources

MANY = {f"{SPIN}[0]": {"linspace": [-2, 2, 300]}, f"{SPIN}[1]": {"linspace": [0, 30, 100]}}
"""30,000 members."""

BARE = re.compile(r"(?<![\w.,-])[1-9]\d{4,}(?![\w.])")
"""A whole number of five digits and more without separators."""


def columns(arrays):
    """Let 11,000 members settle and 12,000 not, and end 7,000 early."""
    k = arrays["run"]
    return {
        "status": np.where(k < 23_000, code("completed"), code("range left")).astype(np.int8),
        "settling_time": np.where(k < 11_000, 1.0, np.nan),
        "smallest_regularity": np.where(k > 22_000, 0.1, 0.9),
    }


def texts_of(block):
    """Return a sentence, or what a table shows, without commands."""
    if isinstance(block, str):
        return [block]
    rows = block.rows if isinstance(block, Table) else ()
    return [cell.text for row in rows for cell in row if not cell.command]


def test_counts_have_separators_and_numbers_of_members_have_none(tmp_path):
    path = write_sweep(tmp_path / "members.h5", MANY, columns).path
    report = report_of(read_sources([path]), "again")
    blocks = [block for section in report.sections for block in section.blocks]
    texts = " | ".join(text for block in blocks for text in texts_of(block))
    for count in ("30,000", "11,000", "12,000", "300 x 100 = 30,000", "7000"):
        assert count in texts
    # Members are named by their numbers, as commands take them.
    assert not BARE.findall(re.sub(r"members? \d[\d, to]*", "", texts))
    (rows,) = (b.rows for b in blocks if isinstance(b, Table) and "notable" in b.name)
    assert max(int(row[0].text) for row in rows) > 9999
    assert all(row[0].command.endswith(f" {row[0].text}") for row in rows)
