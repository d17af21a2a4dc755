"""Protects the size of a page: a report of twenty runs can be sent by mail."""

import dataclasses
from pathlib import Path

import pytest
from support.paper_runs import paper_config, paper_run

from rbstab.config.load import load_config
from rbstab.report.build import report_of
from rbstab.report.reading.sources import Run, Sources
from rbstab.report.writers.html import page

MAX_SHOWN = 2_000_000
"""Bytes of the page of twenty runs; of these, the library takes 405,000."""


@pytest.mark.slow
def test_the_page_of_twenty_runs_can_be_sent_by_mail():
    config = load_config(paper_config("embedded"))
    result = paper_run("embedded", with_gravity=False, engine="scipy")
    first = Run(Path("run-1.h5"), result, config, name="run-1", label="run 1")
    runs = tuple(
        dataclasses.replace(first, number=n, name=f"run-{n + 1}", label=f"run {n + 1}")
        for n in range(20)
    )
    text = page(report_of(Sources(runs, (), ()), "rbstab report"))
    assert "run 20" in text
    assert len(text.encode()) < MAX_SHOWN
