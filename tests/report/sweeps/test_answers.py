"""The answer of a sweep says how many members return, how surely, and which ended early."""

import numpy as np
import pytest
from report.sweeps.cards import answered
from support.made_sweeps import GRID, code

from rbstab.sweep.proofs.columns import NO_PROOF, PROVED

X = "initial_angular_velocity_0"


def mixed(a):
    """Of 20 members 10 rest, one of them elsewhere; 3 are proved, 2 leave and one diverges."""
    member = a["run"]
    return {
        "convergence": np.where(member < 3, PROVED, NO_PROOF),
        "settling_time": np.where(member < 10, 1.0, np.nan),
        "rest_orientation": np.where(member[:, None] == 9, [0.0, 0.5, 0.0], 0.0),
        "status": np.select([member == 19, member >= 17], [code("diverged"), code("range left")]),
    }


def test_each_member_is_counted_once(members):
    answer = answered(members(GRID, mixed, prove="motion"))
    assert answer.sentences == (
        "Returns: 9 of 20 members, 3 of them proved; rests elsewhere: 1; still moving at 1 s: 7; "
        "left the range: 2; failed: 1. Desired: upright (default), within 10°.",
        "The first that ended early is member 17 (range left): rbstab run PLAN --member 17",
    )
    (statement,) = answer.card.statements
    assert (statement.word, statement.tone) == ("9 of 20 return", "")
    assert statement.sentence == answer.sentences[0]


@pytest.mark.parametrize(
    ("columns", "tone", "sentence"),
    [
        (
            lambda _: {},
            "good",
            "Returns: 20 of 20 members. Seen, not proved. Desired: upright (default), within 10°.",
        ),
        (
            lambda _: {"settling_time": np.full(20, np.nan)},
            "",
            "Returns: 0 of 20 members; still moving at 1 s: 20. Desired: upright (default), "
            "within 10°.",
        ),
        (
            lambda a: {
                "rest_orientation": np.where(a[X][:, None] < 0, [0.0, 0.5, 0.0], 0.0),
                "settling_time": np.where(a[X] == 0, np.nan, 1.0),
            },
            "",
            "Returns: 8 of 20 members; rests elsewhere: 8; still moving at 1 s: 4. Seen, not "
            "proved. Desired: upright (default), within 10°. Returns by 1 s for initial "
            "angular_velocity[0] ≥ 1 rad/s; still moving at 1 s at 0; rests elsewhere for ≤ -1.",
        ),
    ],
    ids=["all", "none", "some"],
)
def test_green_is_only_where_all_members_return(members, columns, tone, sentence):
    """The parameter that decides is named with its bracket."""
    answer = answered(members(GRID, columns))
    assert answer.sentences == (sentence,)
    assert answer.card.statements[0].tone == tone
