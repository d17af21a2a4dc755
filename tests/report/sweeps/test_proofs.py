"""Protects what a report says is proved of the members of a sweep: no more than the columns say."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.made_sweeps import GRID
from support.sections import check_sections, figures_in, sweep_sections, tables, texts

from rbstab.report.model.figure import Cells
from rbstab.report.model.palette import colour
from rbstab.report.sweeps.maps.cell_grid import map_grid
from rbstab.report.sweeps.maps.cell_values import NOT_TRIED, proof_cells
from rbstab.report.sweeps.parameters import binned
from rbstab.report.sweeps.proofs import MEANINGS, REASONS, proof_codes, tried_members
from rbstab.sweep.proofs.columns import (
    CONVERGENCE,
    FIRST_UNDECIDED,
    MOTION_PROOFS,
    NO_PROOF,
    NOT_PROVED,
    PROVED,
)
from rbstab.sweep.proofs.convergence import MemberConvergence

PROVE = {"prove": "motion"}


def rgb_of(tone):
    """Return red, green and blue of a colour, 0 to 255."""
    return np.array([*bytes.fromhex(tone[1:])], dtype=int)


def some_of_each(arrays):
    """Members 0 to 9 are proved (the last three later, in state 2), 10 to 14 not decided.

    The motion of member 0 was not decided, but a later proof shows that it starts in a region.
    """
    run = arrays["run"]
    codes = np.select([run < 10, run < 15, run < 17], [2, 3, 4], 1)
    late = (run >= 7) & (run < 10)
    return {
        "convergence": codes,
        "proved_rest_state": np.where(run < 10, np.where(late, 2, 1), 0),
        "proved_time": np.where(late, 0.25 * run, np.where(run < 10, 0.0, np.nan)),
        "motion_proof": np.select(
            [run == 0, late, run < 10, run < 12, run < 15, run < 17], [3, 1, 0, 3, 5, 2], 0
        ),
    }


@pytest.fixture
def sections(made):
    found = sweep_sections(made(GRID, some_of_each, **PROVE))
    check_sections(found)
    return found


def test_a_sentence_counts_the_proved_members(sections):
    assert sections[0].blocks[2] == (
        "10 of 20 members are proved to converge to a rest state, 3 of them by an enclosure of "
        "their exact motion. 2 are proved not to come to rest. 5 are not decided; the table has "
        "the reasons. 3 start in no certified region, and their motion was not "
        "enclosed."
    )


def test_the_table_has_the_reasons(sections):
    rows = texts(tables(sections)["sweep-1-proofs"])
    assert rows == [
        ["converges to rest state 1: proved", "7"],
        ["converges to rest state 2: proved", "3"],
        ["does not come to rest: proved", "2"],
        ["not decided", "5"],
        ["not proved at the start, motion not enclosed", "3"],
        ["of those not decided: the enclosure reached its largest number of steps", "2"],
        ["of those not decided: no further step of the enclosure could be proved", "3"],
    ]


def test_the_map_shows_what_is_proved(sections):
    panels = {p.title: p for p in figures_in(sections)["sweep-1-map"].panels}
    (cells,) = (m for m in panels["convergence of the exact motion"].marks if isinstance(m, Cells))
    # Five columns of four members each; the second axis is the fastest.
    words = np.array(cells.scale.categories)[cells.values.T.astype(int)].ravel().tolist()
    expected = [MEANINGS[2].format(1)] * 7 + [MEANINGS[2].format(2)] * 3
    expected += [MEANINGS[3]] * 5 + [MEANINGS[4]] * 2 + [MEANINGS[1]] * 3
    assert words == expected
    assert "time from which inside a certified region [s]" in panels


def test_answers_have_the_colours_of_their_kind(members):
    codes = (2, 3, 4, 1, 0)

    def some_of_every_code(arrays):
        convergence = np.resize(codes, len(arrays["run"]))
        return {"convergence": convergence, "proved_rest_state": convergence == 2}

    found = proof_codes(members(GRID, some_of_every_code, **PROVE))
    tones = dict(zip(found.labels, map(colour, found.colours), strict=True))
    good, bad = (rgb_of(tones[MEANINGS[code].format(1)]) for code in (2, 4))
    assert good.argmax() == 1
    assert bad.argmax() == 0
    for code in (1, 3):
        assert np.ptp(rgb_of(tones[MEANINGS[code]])) == 0
    assert len(set(tones.values())) == len(codes)


def test_cells_with_several_members_show_the_share(members):
    def columns(arrays):
        return {"convergence": np.where(arrays["run"] < 10, 2, 1)}

    found = members(GRID | {"body.mass": {"values": [40, 41]}}, columns)
    axes = {p.axis.label: binned(p) for p in found.parameters}
    first, second = (axes[f"initial angular_velocity[{k}]"] for k in (0, 1))
    cells = proof_cells(found, map_grid(first, second))
    # Eight members in a row of the first axis, two in each cell: the first ten are proved.
    expected = np.zeros((4, 5))
    expected[:, 0] = expected[0, 1] = 1.0
    assert cells.values.tolist() == expected.tolist()
    assert cells.scale.label == "share proved to converge"
    (mass,) = (axis for label, axis in axes.items() if "mass" in label)
    half = proof_cells(found, map_grid(mass, second))
    assert half.values.ravel().tolist() == pytest.approx([0.4, 0.4] + [0.2, 0.2] * 3)


@pytest.mark.parametrize(("untried", "of"), [(0, "20"), (3, "the 17"), (20, "20")])
def test_what_was_not_tried_is_not_0_of_1000(untried, of):
    codes = np.where(np.arange(20) < untried, NO_PROOF, NOT_PROVED)
    assert tried_members(codes) == f"{of} members{' that were tried' if 'the' in of else ''}"


def test_a_cell_without_any_proof_has_no_share(members):
    """What was not tried is not 0 of 1000."""

    def columns(arrays):
        proved_or_not = np.where(arrays["run"] < 10, PROVED, NOT_PROVED)
        return {"convergence": np.where(arrays["run"] < 32, proved_or_not, NO_PROOF)}

    found = members(GRID | {"body.mass": {"values": [40, 41]}}, columns)
    first, second = (
        binned(p)
        for k in (0, 1)
        for p in found.parameters
        if p.axis.label == f"initial angular_velocity[{k}]"
    )
    cells = proof_cells(found, map_grid(first, second))
    assert np.isnan(cells.values[:, 4]).all()
    assert np.isfinite(cells.values[:, :4]).all()
    assert cells.members is not None
    reasons = cells.members.reasons
    assert {reasons[code] for code in cells.members.gaps[:, 4]} == {NOT_TRIED}
    (mass,) = (binned(p) for p in found.parameters if "mass" in p.axis.label)
    # Sixteen of twenty members of each mass have a proof, or eight of ten with one of the second.
    half = proof_cells(found, map_grid(mass, second))
    assert half.values.ravel().tolist() == pytest.approx([0.5, 0.5] + [0.25, 0.25] * 3)


def test_a_share_that_is_the_same_for_all_explains_nothing(made):
    """A map that has nothing to show is not "left out, explained: nan %"."""
    vary = {f"initial.angular_velocity[{k}]": {"uniform": [-9, 9]} for k in (0, 1)}

    def columns(arrays):
        return {"convergence": np.where(arrays["run"] % 2, NOT_PROVED, NO_PROOF)}

    found = sweep_sections(made(vary, columns, design="random", members=400, seed=1))
    texts_ = [block for section in found for block in section.blocks if isinstance(block, str)]
    assert not any("nan" in text for text in texts_)
    assert not any(name.startswith("sweep-1-map-proofs") for name in figures_in(found))
    panels = [p.title for name, f in figures_in(found).items() if "map" in name for p in f.panels]
    assert "share proved to converge" not in panels


def test_without_proofs_nothing_is_said(made):
    found = sweep_sections(made(GRID))
    assert "sweep-1-proofs" not in tables(found)
    assert not any("proved" in block for block in found[0].blocks if isinstance(block, str))


def test_proofs_of_other_variants_made_later_count(members):
    """When the sweep was finished, one of its variants had a proof, and the other had none."""
    vary = {"controller.variant": {"values": ["free", "visco-elastic"]}} | GRID
    found = members(vary, lambda a: {"convergence": np.where(a["run"] < 20, 0, 1)})
    now = MemberConvergence(np.where(np.arange(40) < 20, 2, 0), np.repeat([1, 0], 20), np.zeros(40))
    found.__dict__["_certified"] = SimpleNamespace(
        of=lambda *_members: now, within=lambda *arguments: arguments[-1]
    )
    assert found.convergence.tolist() == [2] * 20 + [1] * 20
    assert found.proved_rest_states.tolist() == [1] * 20 + [0] * 20


def test_every_code_has_words():
    assert sorted(MEANINGS) == list(range(len(CONVERGENCE)))
    assert tuple(REASONS) == MOTION_PROOFS[FIRST_UNDECIDED:]
