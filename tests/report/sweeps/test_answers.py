"""The card of a sweep says how many members come to rest, and how surely; and which is better."""

import numpy as np
from report.sweeps.cards import RANGE, REST, answered, card_of
from support.configs import VISCO_ELASTIC, plain
from support.made_sweeps import GRID, SPIN, code

from rbstab.experiment.robust.record import BodiesRecord
from rbstab.report.sweeps.answers import answer_of
from rbstab.report.sweeps.proofs import proof_blocks
from rbstab.sweep.proofs.columns import CONVERGENCE
from rbstab.sweep.proofs.one_state import OneState

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

X = "initial_angular_velocity_0"


def sentence_of(members):
    """Return the sentence on all members."""
    return answer_of("sweep-1", "made", members, "rbstab sweep PLAN --prove").sentences[0]


def convergence(word):
    return CONVERGENCE.index(word)


def test_without_a_proof_the_end_of_the_runs_is_seen(members):
    sentences, card = card_of(
        members(GRID, lambda a: {"settling_time": np.where(a["run"] < 15, 1.0, np.nan)})
    )
    rest, in_range = answered(card, REST), answered(card, RANGE)
    assert (rest.word, in_range.word) == ("15 of 20 seen", "seen")
    assert rest.sentence == (
        "Not proved: no proof was made for any of the 20 members (rbstab sweep PLAN --prove makes "
        "it); of the 20 members, 15 were at rest by the end of their computed run, 5 were not"
    )
    assert card.statements[0].word == "15 of 20 return"
    assert sentences == []


def test_proved_is_said_only_of_all_members(members):
    def proved(count):
        def columns(a):
            words = convergence("proved"), convergence("not decided")
            return {"convergence": np.where(a["run"] < count, *words)}

        return answered(card_of(members(GRID, columns, prove="motion"))[1], REST)

    whole, part = proved(20), proved(10)
    assert (whole.word, whole.tone) == ("proved", "")
    assert (part.word, part.tone) == ("10 of 20 proved", "")
    assert part.sentence.startswith(
        "10 of 20 members are proved to converge to a rest state; of the 10 others, "
    )


def test_one_counterexample_is_enough(members):
    def columns(a):
        return {"convergence": np.where(a["run"] == 3, convergence("false"), convergence("proved"))}

    _, card = card_of(members(GRID, columns, prove="motion"))
    assert (answered(card, REST).word, answered(card, REST).tone) == ("false", "bad")
    assert "1 are proved not to come to rest" in answered(card, REST).sentence


def test_a_member_is_counted_once(members):
    """A member that is proved not to come to rest may look as if it did in its computed run."""

    def columns(a):
        words = convergence("false"), convergence("not decided")
        return {"convergence": np.where(a["run"] < 5, *words), "settling_time": 1.0 + 0 * a["run"]}

    _, card = card_of(members(GRID, columns, prove="motion"))
    assert answered(card, REST).sentence.endswith(
        "5 are proved not to come to rest; of the 15 others, all were at rest by the end of their "
        "computed run"
    )


def test_members_that_left_the_range(members):
    _, card = card_of(
        members(GRID, lambda a: {"status": np.where(a["run"] < 4, code("range left"), 0)})
    )
    stay = answered(card, RANGE)
    found = (stay.word, stay.sentence, stay.tone)
    assert found == ("4 of 20 left it", "As computed: members 0 to 3", "bad")


def test_the_member_that_came_nearest_to_the_end_of_the_range_is_named(members):
    def columns(nearest):
        return lambda a: {"smallest_regularity": np.where(a["run"] == 7, nearest, 0.9)}

    _, card = card_of(members(GRID, columns(np.sin(0.02))))
    assert answered(card, RANGE).sentence.endswith("; member 7 came within 0.02 rad of its end")
    _, card = card_of(members(GRID, columns(np.sin(0.2))))
    assert answered(card, RANGE).sentence == "No computed motion left it"


def test_members_without_a_proof_were_not_tried(members):
    def columns(a):
        words = convergence("proved"), convergence("not proved"), convergence("unknown")
        return {"convergence": np.select([a["run"] < 3, a["run"] < 8], words[:2], words[2])}

    _, card = card_of(members(GRID, columns, prove="motion"))
    assert answered(card, REST).word == "3 of 20 proved"
    assert answered(card, REST).sentence.startswith("3 of the 8 members that were tried are proved")


def test_members_at_rest_later_count_in_the_median(members):
    """Nine of 20 members are at rest by the end, so the median is later than the end."""

    def columns(count):
        return lambda a: {"settling_time": np.where(a["run"] < count, 0.1 * a["run"], np.nan)}

    def median(count):
        return dict(card_of(members(GRID, columns(count)))[1].facts)["at rest from (median of all)"]

    assert median(9) == "after the end"
    assert median(10) == "0.9 s"


def test_members_that_no_theorem_covers_are_counted_with_the_reason(members):
    vary = {
        "controller.variant": {"each": {"values": ["visco-elastic", "sliding"]}},
        f"{SPIN}[0]": {"normal": [0, 6]},
    }

    def columns(a):
        is_sliding = a["controller_variant"] == 1
        words = convergence("unknown"), convergence("proved")
        return {"convergence": np.where(is_sliding, *words)}

    base = plain(VISCO_ELASTIC)
    base["controller"] |= {"K_s": [2000, 2000, 2000], "surface": {"slope": 20}}
    made = members(vary, columns, base=base, design="random", members=10, seed=4)
    sentence = answered(card_of(made)[1], REST).sentence
    assert sentence.startswith(
        "10 of the 10 members that were tried are proved to converge to a rest state "
        "(visco-elastic: 10 of 10; sliding: not tried); 10 have no proof: the force of a sliding "
        "connector jumps"
    )
    text, _ = proof_blocks("sweep-1", made, "COMMAND")
    assert isinstance(text, str)
    assert "10 have no proof: the force of a sliding connector jumps" in text
    assert "COMMAND" not in text


def test_the_first_sentence_counts_each_member_once(members):
    def columns(a):
        member = a["run"]
        return {
            "convergence": np.where(member < 3, convergence("proved"), convergence("unknown")),
            "settling_time": np.where(member < 10, 1.0, np.nan),
            "rest_orientation": np.where(member[:, None] == 9, [0.0, 0.5, 0.0], 0.0),
            "status": np.select(
                [member == 19, member >= 17], [code("diverged"), code("range left")]
            ),
        }

    found = members(GRID, columns, prove="motion")
    assert sentence_of(found) == (
        "Returns: 9 of 20 members, 3 of them proved; rests elsewhere: 1; still moving at 1 s: 7; "
        "left the range: 2; failed: 1. Desired: upright (default), within 10°."
    )
    first = card_of(found)[1].statements[0]
    assert (first.word, first.tone) == ("9 of 20 return", "")


def test_green_is_only_where_all_members_return(members):
    _, card = card_of(members(GRID))
    assert [statement.tone for statement in card.statements] == ["good", "", ""]


def test_the_parameter_that_decides_is_named_with_its_bracket(members):
    def columns(a):
        return {
            "rest_orientation": np.where(a[X][:, None] < 0, [0.0, 0.5, 0.0], 0.0),
            "settling_time": np.where(a[X] == 0, np.nan, 1.0),
        }

    text = (
        "Returns by 1 s for initial angular_velocity[0] ≥ 1 rad/s; still moving at 1 s at 0; "
        "rests elsewhere for ≤ -1."
    )
    answer = answer_of("sweep-1", "made", members(GRID, columns), "COMMAND")
    assert answer.sentences[1] == text
    assert (
        answer.card.statements[1].word == "Returns by 1 s for initial angular_velocity[0] ≥ 1 rad/s"
    )


def statements_of(members, one_state, *, older=False):
    """Return what the card says of rest states, given which bodies have one."""
    found = members(GRID, lambda a: {"settling_time": np.zeros(len(a["run"]))})
    assert found.one_state == OneState()
    vars(found)["one_state"] = one_state
    if older:
        del found.table.variables["rest_orientation"]
    return [one for one in card_of(found)[1].statements if "one rest state" in one.question]


def test_bodies_that_have_one_rest_state_are_counted(members):
    assert statements_of(members, OneState()) == []
    (part,) = statements_of(members, OneState(20, 15, levels=[617.5] * 15))
    assert (part.word, part.tone) == ("15 of 20 proved", "")
    assert part.sentence == (
        "One rest state in the range of the Euler angles, a minimum: proved for 15 of 20 distinct "
        "bodies, not decided for 5. Each motion of a proved body that stays in the range, and "
        "keeps a distance from its end in θ2, converges to its rest state. So does each motion "
        "that starts in the range with v(0) below 617.5 J"
    )
    (two,) = statements_of(members, OneState(20, 20, levels=[617.5] * 10 + [480.0] * 10))
    assert (two.word, two.tone) == ("proved", "")
    assert "below 480 J (of some bodies up to 617.5 J)" in two.sentence
    (old,) = statements_of(members, OneState(20, 20, levels=[617.5] * 20), older=True)
    assert "v(0)" not in old.sentence
    (both,) = statements_of(members, OneState(20, 18, levels=[617.5] * 15))
    assert "proved for 18 of 20 distinct bodies (15 of them many at once)" in both.sentence
    assert ". Of those proved at once, so does each motion that starts" in both.sentence
    (own,) = statements_of(members, OneState(20, 18))
    assert "v(0)" not in own.sentence


def test_a_body_with_several_rest_states_is_a_counterexample(members):
    (found,) = statements_of(members, OneState(20, 15, false=[2, 3, 7]))
    assert (found.word, found.tone) == ("false", "bad")
    assert "false for 3 (members 2 to 3, 7), not decided for 2" in found.sentence


def test_a_body_between_the_bounds_that_refutes_is_named(members):
    """Nothing may be known of the bodies of the sweep itself."""
    one_state = OneState(20, counterexamples={"permanent": COUNTEREXAMPLE})
    of_bodies, between = statements_of(members, one_state)
    assert (of_bodies.word, of_bodies.tone) == ("not decided", "")
    assert "converges" not in of_bodies.sentence
    assert (between.word, between.tone) == ("false", "bad")
    assert between.sentence == (
        "For every body between the least and the greatest value of each number of the plan: one "
        "rest state, a minimum: false, proved. The body with body.mass = 40.5, controller.K_r = "
        "[80, 80, 64] can rest at Θ = (0, 0.1, 0) and (2, 1.5, 3) rad"
    )
    _, of_variant = statements_of(members, one_state._replace(of_variants=True))
    assert of_variant.sentence.startswith("For every body of variant permanent between the least")


def test_the_section_on_proofs_says_it_too(members):
    found = members(GRID)
    assert proof_blocks("sweep-1", found, "COMMAND") == []
    one_state = OneState(20, 15, [3], counterexamples={"permanent": COUNTEREXAMPLE})
    vars(found)["one_state"] = one_state
    (text,) = proof_blocks("sweep-1", found, "COMMAND")
    assert text == (
        "One rest state in the range of the Euler angles, a minimum: proved for 15 of 20 distinct "
        f"bodies, false for 1 (members 3), not decided for 4. {one_state.refutations[0]}."
    )
    proved = members(GRID, lambda a: {"convergence": 2 + 0 * a["run"]})
    vars(proved)["one_state"] = one_state
    assert text in proof_blocks("sweep-1", proved, "COMMAND")
