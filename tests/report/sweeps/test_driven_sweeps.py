"""Sweeps whose inputs supply power: v(0) may be round-off, and no proof is possible."""

import numpy as np
import pytest
from report.sweeps.cards import REST, answered
from support.configs import VISCO_ELASTIC, plain
from support.inputs import SINE, force
from support.made_sweeps import GRID
from support.sections import figures_in, sweep_sections, tables

from rbstab.report.model.document import Cards
from rbstab.report.model.figure import Bars


def at_rest(arrays):
    """Members that start at rest: v(0) is zero up to round-off, and v(end) is some J."""
    n = len(arrays["run"])
    noise = np.where(arrays["run"] % 2, 1e-19, -3e-20)
    return {
        "lyapunov_start": noise,
        "lyapunov_end": np.full(n, 2.0),
        "settling_time": np.full(n, np.nan),
        "energy_residual": 1e-12 * (1.0 + arrays["run"]),
        "energy_scale": np.full(n, 2.0),
        "smallest_regularity": 0.02 * (1.0 + arrays["run"]),
    }


@pytest.fixture
def sections(made):
    base = plain(VISCO_ELASTIC) | {"schema_version": 2, "elements": {"shake": force(SINE)}}
    return sweep_sections(made(GRID, at_rest, base=base))


def test_the_card_says_why_nothing_is_proved(sections):
    (cards,) = [block for part in sections for block in part.blocks if isinstance(block, Cards)]
    assert answered(cards.cards[0], REST).sentence == (
        "Not proved: an input supplies power, so v may rise; of the 20 members, none was at rest "
        "by the end of their computed run"
    )


def test_notable_members_have_no_round_off(sections):
    table = tables(sections)["sweep-1-notable"]
    (column,) = [n for n, head in enumerate(table.heads) if head.label == "v(0)"]
    assert {row[column].text for row in table.rows} == {"0"}


def test_the_residual_names_what_it_is_divided_by(sections):
    label = "max |r| / largest energy"
    panels = figures_in(sections)["sweep-1-histograms"].panels
    (panel,) = [panel for panel in panels if panel.x.label == label]
    (bars,) = panel.marks
    assert isinstance(bars, Bars)
    assert bars.edges[-1] == pytest.approx(1e-11)
