"""A page with a run and a sweep: one unit for one quantity, and each word explained once."""

import re

import pytest
from support.made_runs import made_config, made_file
from support.made_sweeps import GRID, write_sweep

from rbstab.report.build import report_of
from rbstab.report.model.document import Cards, Table
from rbstab.report.model.figure import Figure
from rbstab.report.reading.sources import read_sources

LENGTH = re.compile(r"(?:\d |\[)(km|m|cm|mm|µm)\]?$")
"""A number with a unit of length, or such a unit in brackets, at the end of a text."""


def lengths(report):
    """Return every text of a report that ends with a unit of length, with that unit."""
    units: dict[str, str] = {}
    for block in (block for section in report.sections for block in section.blocks):
        texts = []
        if isinstance(block, Cards):
            texts = [f"{name}: {value}" for card in block.cards for name, value in card.facts]
        elif isinstance(block, Table):
            texts = [head.text for head in block.heads]
            texts += [cell.text for row in block.rows for cell in row]
        elif isinstance(block, Figure):
            texts = [axis.text for panel in block.panels for axis in (panel.x, panel.y)]
        units |= {text: unit[1] for text in texts if (unit := LENGTH.search(text))}
    return units


@pytest.fixture
def report(tmp_path):
    reference = {"source": "a book", "peak_contact_displacement": [-0.04, 0.03, 0.06]}
    run = made_file(tmp_path / "made.h5", made_config(reference=reference))
    sweep = write_sweep(tmp_path / "grid" / "members.h5", GRID).path
    return report_of(read_sources([run, sweep]), "again")


def test_lengths_have_one_unit(report):
    units = lengths(report)
    assert set(units.values()) == {"m"}
    for where in ("peak |E|", "peak E1", "peak contact displacement", "contact displacement E"):
        assert any(text.startswith(where) for text in units), where
    assert "largest |E1|, |E2| or |E3| [m]" in units


def test_a_word_on_cards_of_runs_and_sweeps_is_explained_once(report):
    cards = [block for section in report.sections for block in section.blocks if is_cards(block)]
    assert len(cards) == 2
    words = [word for block in cards for word, _ in block.words]
    assert {"proved", "seen", "v(0)", "E1, E2, E3"} <= set(words)
    assert len(words) == len(set(words))


def is_cards(block):
    return isinstance(block, Cards)
