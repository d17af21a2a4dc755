"""Protects what a report says is proved of the members of a sweep: no more than the columns say."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.configs import VISCO_ELASTIC, plain
from support.inputs import SINE, force
from support.made_sweeps import GRID
from support.sections import check_sections, figures_in, sweep_sections, tables, texts

from rbstab.experiment.robust.record import BodiesRecord
from rbstab.report.model.document import Table
from rbstab.report.model.figure import Cells
from rbstab.report.sweeps.maps.cells import cells_of, map_grid
from rbstab.report.sweeps.maps.shown import shown_of
from rbstab.report.sweeps.parameters import binned
from rbstab.report.sweeps.proofs import MEANINGS, REASONS, proof_blocks
from rbstab.sweep.proofs.columns import (
    CONVERGENCE,
    FIRST_UNDECIDED,
    MOTION_PROOFS,
    NO_PROOF,
    NOT_PROVED,
    PROVED,
)
from rbstab.sweep.proofs.convergence import MemberConvergence
from rbstab.sweep.proofs.sole_state import SoleState

PROVE = {"prove": "motion"}


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
    checked = sweep_sections(made(GRID, some_of_each, **PROVE))
    check_sections(checked)
    return checked


def test_the_table_has_the_reasons(sections):
    rows = texts(tables(sections)["sweep-1-proofs"])
    assert rows == [
        ["converges to rest state 1: proved", "7"],
        ["converges to rest state 2: proved", "3"],
        ["does not come to rest: proved", "2"],
        ["not decided", "5"],
        ["not proved at the start, motion not enclosed", "3"],
        ["of those proved: by an enclosure of their motion", "3"],
        ["of those not decided: the enclosure reached its largest number of steps", "2"],
        ["of those not decided: no further step of the enclosure could be proved", "3"],
    ]


def test_the_map_shows_what_is_proved(sections):
    panels = {p.title: p for p in figures_in(sections)["sweep-1-first"].panels}
    (cells,) = panels["convergence of the exact motion"].marks
    assert isinstance(cells, Cells)
    # Five columns of four members each; the second axis is the fastest.
    words = np.array(cells.scale.categories)[cells.values.T.astype(int)].ravel().tolist()
    first, second = (words_of(PROVED).format(k) for k in (1, 2))
    expected = [first] * 7 + [second] * 3
    expected += [words_of(code) for code, count in ((3, 5), (4, 2), (1, 3)) for _ in range(count)]
    assert words == expected


def words_of(code):
    return MEANINGS[code][0]


TWO = GRID | {"body.mass": {"values": [40, 41]}}
"""Eight members in a row of the first spin, two in each cell of both."""


def map_of(swept, axes):
    """Return the map of shares of proved members over two parameters, by their labels."""
    over = {p.axis.label: binned(p) for p in swept.parameters}
    (proofs,) = (quantity.of_several for quantity in shown_of(swept) if quantity.name == "proofs")
    x, y = (over[label] for label in axes)
    return cells_of(swept, map_grid(x, y), proofs)


FIRST, SECOND = (f"initial angular_velocity[{k}]" for k in (0, 1))


def test_what_was_not_tried_is_not_0_of_1000(members):
    def columns(arrays):
        proved_or_not = np.where(arrays["run"] < 10, PROVED, NOT_PROVED)
        return {"convergence": np.where(arrays["run"] < 32, proved_or_not, NO_PROOF)}

    swept = members(TWO, columns)
    cells = map_of(swept, (FIRST, SECOND))
    assert np.isnan(cells.values[:, 4]).all()
    assert np.isfinite(cells.values[:, :4]).all()
    assert cells.members is not None
    reasons = cells.members.reasons
    assert {reasons[code] for code in cells.members.gaps[:, 4]} == {"no proof of the bodies"}
    # Sixteen of twenty members of each mass have a proof, or eight of ten with one of the second.
    half = map_of(swept, ("mass", SECOND))
    assert half.values.ravel().tolist() == pytest.approx([0.5, 0.5] + [0.25, 0.25] * 3)


def said(swept):
    """Return the sentences on proofs, and the note of the table."""
    blocks = proof_blocks("sweep-1", swept, "COMMAND")
    return [block.note if isinstance(block, Table) else block for block in blocks]


def test_what_was_not_tried_has_its_reason(members):
    """Of some members, in the note; of all, as a sentence in place of a table."""
    codes = np.where(np.arange(20) < 3, NO_PROOF, NOT_PROVED)
    (note,) = said(members(GRID, lambda _: {"convergence": codes}))
    assert note.endswith("No proof was made of the bodies of members 0 to 2: COMMAND makes it.")
    (sentence,) = said(members(GRID))
    assert sentence == "No proof was made of the bodies of any member: COMMAND makes it."
    shaken = plain(VISCO_ELASTIC) | {"schema_version": 2, "elements": {"shake": force(SINE)}}
    (sentence,) = said(members(GRID, base=shaken))
    assert sentence == "Convergence is not proved: an element supplies power, so v may rise."


def test_members_that_no_theorem_covers_are_counted_with_the_reason(members):
    vary = {
        "controller.variant": {"each": {"values": ["visco-elastic", "sliding"]}},
        "initial.angular_velocity[0]": {"normal": [0, 6]},
    }
    base = plain(VISCO_ELASTIC)
    base["controller"] |= {"K_s": [2000, 2000, 2000], "surface": {"slope": 20}}
    swept = members(
        vary,
        lambda a: {"convergence": np.where(a["controller_variant"] == 1, NO_PROOF, PROVED)},
        base=base,
        design="random",
        members=10,
        seed=4,
    )
    (table,) = proof_blocks("sweep-1", swept, "COMMAND")
    assert isinstance(table, Table)
    label, count = texts(table)[-1]
    assert label.startswith("of those without a proof: the force of a sliding connector jumps")
    assert count == "10"
    assert "COMMAND" not in table.note


COUNTEREXAMPLE = BodiesRecord(
    id="0",
    version=1,
    outcome="a body in the box has several rest states",
    proved=False,
    level=0.0,
    parts=1,
    boxes=1,
    why="",
    seconds=0.1,
    sections={},
    tolerances=(),
    body={
        "body.mass": "40.5",
        **{f"controller.K_r[{axis}]": text for axis, text in enumerate(("80", "80", "64"))},
    },
    rest_states=((0.0, 0.1, 0.0), (2.0, 1.5, 3.0)),
)
STATES = "One rest state in the range of the Euler angles, a minimum: "
MOTIONS = (
    "Each motion of a proved body that stays in the range, and keeps a distance from its end in "
    "θ2, converges to its rest state."
)
BETWEEN = (
    "For every body between the least and the greatest value of each number of the plan: one rest "
    "state, a minimum: false, proved. The body with body.mass = 40.5, controller.K_r = [80, 80, "
    "64] can rest at Θ = (0, 0.1, 0) and (2, 1.5, 3) rad"
)


@pytest.mark.parametrize(
    ("sole_state", "older", "text"),
    [
        (
            SoleState(20, 20, levels=[617.5] * 10 + [480.0] * 10),
            False,
            f"{STATES}proved for 20 of 20 distinct bodies. {MOTIONS} So does each motion that "
            "starts in the range with v(0) below 480 J (of some bodies up to 617.5 J).",
        ),
        (
            SoleState(20, 20, levels=[617.5] * 20),
            True,
            f"{STATES}proved for 20 of 20 distinct bodies. {MOTIONS}",
        ),
        (
            SoleState(20, 18, levels=[617.5] * 15),
            False,
            f"{STATES}proved for 18 of 20 distinct bodies (15 of them many at once), not decided "
            f"for 2. {MOTIONS} Of those proved at once, so does each motion that starts in the "
            "range with v(0) below 617.5 J.",
        ),
        (
            SoleState(20, 15, false=[2, 3, 7]),
            False,
            f"{STATES}proved for 15 of 20 distinct bodies, false for 3 (members 2 to 3, 7), not "
            f"decided for 2. {MOTIONS}",
        ),
        # Nothing may be known of the bodies of the sweep itself.
        (
            SoleState(20, counterexamples={"permanent": COUNTEREXAMPLE}),
            False,
            f"{STATES}proved for 0 of 20 distinct bodies, not decided for 20. {BETWEEN}.",
        ),
    ],
    ids=["two levels", "older", "both ways", "false", "between"],
)
def test_bodies_that_have_one_rest_state_are_counted(members, sole_state, older, text):
    swept = members(GRID, lambda a: {"settling_time": np.zeros(len(a["run"]))})
    assert swept.sole_state == SoleState()
    vars(swept)["sole_state"] = sole_state
    if older:
        del swept.table.variables["rest_orientation"]
    assert said(swept)[0] == text


def test_proofs_of_other_variants_made_later_count(members):
    """When the sweep was finished, one of its variants had a proof, and the other had none."""
    vary = {"controller.variant": {"values": ["free", "visco-elastic"]}} | GRID
    swept = members(vary, lambda a: {"convergence": np.where(a["run"] < 20, 0, 1)})
    now = MemberConvergence(np.where(np.arange(40) < 20, 2, 0), np.repeat([1, 0], 20), np.zeros(40))
    swept.__dict__["_certified"] = SimpleNamespace(
        of=lambda *_members: now, within=lambda *arguments: arguments[-1]
    )
    assert swept.convergence.tolist() == [2] * 20 + [1] * 20
    assert swept.proved_rest_states.tolist() == [1] * 20 + [0] * 20


def test_every_code_has_words():
    assert sorted(MEANINGS) == list(range(len(CONVERGENCE)))
    assert tuple(REASONS) == MOTION_PROOFS[FIRST_UNDECIDED:]
