"""The program proves what the table of claims says, or more (`python -m support.claims`)."""

import copy

import pytest
from support.claims import table
from support.claims.compare import gained, lost, lost_within
from support.claims.evidence import doubts
from support.claims.program import claims_of
from support.claims.tolerances import WITHIN, within

STORED = table.read(table.TABLE)

QUICK = (
    "configs/paper/case1_permanent.yaml",
    "configs/paper/case2_guarded.yaml",
    "00 permanent",
    "04 permanent, barrier",
    "12 permanent, stop",
    "14 permanent, tie, creeping tie",
    "27 permanent, no K_r, attitude, tie, barrier",
    "31 visco-elastic, attitude",
)
"""Of several kinds; their proofs take about seven seconds together."""


def test_the_table_has_all_configs():
    assert list(STORED) == table.names()


@pytest.mark.parametrize("name", QUICK)
def test_what_was_proved_is_proved(name):
    assert lost(STORED[name], claims_of(table.config_of(name))) == []


@pytest.mark.heavy
@pytest.mark.parametrize("name", [name for name in STORED if name not in QUICK])
def test_what_was_proved_of_others_is_proved(name):
    assert lost(STORED[name], claims_of(table.config_of(name))) == []


@pytest.mark.heavy
@pytest.mark.parametrize("name", WITHIN)
def test_what_was_proved_within_tolerances_is_proved(name):
    assert lost_within(STORED[name]["within"], within(name)) == []


def test_no_claim_of_the_table_is_doubted():
    assert {name: claim["doubts"] for name, claim in STORED.items() if claim["doubts"]} == {}


def _changed(path, value):
    """Return the claims about a body with four rest states, and others with one entry changed."""
    before = STORED["04 permanent, barrier"]
    now = copy.deepcopy(before)
    place = now
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value(place[path[-1]])
    return before, now


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        (("range", "complete"), lambda _: False, "complete"),
        (("all_angles", "complete"), lambda _: False, "complete"),
        (("all_angles",), lambda _: None, "not searched"),
        (("range", "states"), lambda states: states[:-1], "4 states became 3"),
        (("range", "states", 1, "at", 2), lambda angle: angle + 2e-6, "is missing"),
        (("range", "states", 1, "index"), lambda index: index + 1, "index"),
        (("range", "states", 0, "energy"), lambda energy: energy + 1e-3, "energy"),
        (("range", "states", 3, "proved"), lambda _: False, "not proved"),
        (("range", "level"), lambda level: 0.97 * level, "level"),
        (("all_angles", "level"), lambda _: None, "level"),
        (("range", "depths"), lambda _: {}, "depth"),
        (("this_start", "state"), lambda _: None, "this_start"),
        (("this_start", "state"), lambda _: 2, "this_start"),
        (("almost_every_start", "proved"), lambda _: False, "almost_every_start"),
        (("keeps_range",), lambda _: True, "keeps_range"),
        (("passive",), lambda _: False, "passive"),
    ],
)
def test_a_lost_claim_is_named(path, value, words):
    before, now = _changed(path, value)
    assert any(words in text for text in lost(before, now))


def test_every_start_may_not_be_lost():
    before = STORED["configs/paper/case1_guarded.yaml"]
    assert lost(before, {**before, "every_start": False}) == ["every_start"]


def test_more_claims_and_higher_levels_are_allowed():
    before, now = _changed(("range", "level"), lambda level: 1.01 * level)
    assert lost(before, now) == []
    less = {**before, "all_angles": None, "every_start": False}
    assert lost(less, before) == []
    assert gained(less, before) == ["all_angles: complete"]


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("all_angles", "states"), lambda states: states[:2] + states[3:]),
        (("range", "states", 1, "index"), lambda index: index + 1),
        (("range", "states", 0, "at", 0), lambda angle: angle + 0.01),
        (("all_angles", "level"), lambda level: 1.05 * level),
    ],
    ids=["a missing state", "an index", "a place", "a level"],
)
def test_a_wrong_claim_is_doubted(path, value):
    _, wrong = _changed(path, value)
    doubted = doubts(table.config_of("04 permanent, barrier"), wrong)
    assert set(doubted) == {path[0]}


def test_a_level_within_tolerances_may_not_be_lost():
    before = {"a=±1%": {"proved": True, "why": "", "level": 100.0}}
    assert lost_within(before, before) == []
    for change in ({"level": 97.0}, {"proved": None}, {"proved": False}):
        now = {"a=±1%": {**before["a=±1%"], **change}}
        assert len(lost_within(before, now)) == 1
