"""True records are verified, and wrong ones are refused."""

from collections.abc import Callable

import pytest
from proof.check.cases import BORDER, EXACT, LEAST, TRUE, changed, refused, state, tilted, weak

from rbstab.proof.record import Record


@pytest.fixture(scope="module")
def records():
    return {name: make() for name, make in TRUE.items()}


@pytest.mark.parametrize("name", TRUE)
def test_true_records_are_verified(records, name):
    assert refused(records[name]) == []


def _at(*path, to):
    return lambda record: changed(record, *path, to=to)


def _without_state(k):
    def change(record: Record) -> Record:
        left = [other for i, other in enumerate(record["ranges"][0]["states"]) if i != k]
        return changed(changed(record, *STATES, to=left), "ranges", 0, "regions", to=[])

    return change


def _operation(old, new):
    def change(record: Record) -> Record:
        operations = record["energy"]["operations"]
        return changed(record, "energy", "operations", operations.index(old), to=new)

    return change


def _factor(old, new):
    """Change a factor of the last sum."""

    def change(record: Record) -> Record:
        last = record["energy"]["operations"][-1]
        return changed(record, "energy", "operations", -1, last.index(old), to=new)

    return change


STATES = ("ranges", 0, "states")
LOW = (*STATES, 0, "enclosure", 0)
BOX = [[1.0, 1.0, 1.0], [1.1, 1.1, 1.1]]

WRONG: dict[str, tuple[str, Callable[[Record], Record], str]] = {
    # a state
    "a missing minimum": ("wells", _without_state(1), "no other rest state"),
    "a missing held state": ("held", _without_state(0), "no other rest state"),
    "a missing state on a ridge": ("ridge", _without_state(2), "no other rest state"),
    "a missing state at a stop": ("stop", _without_state(0), "no other rest state"),
    "a missing state at a stop with an own state": (
        "own_state_at_stop",
        _without_state(0),
        "no other rest state",
    ),
    "a state twice": (
        "held",
        _at(*STATES, to=[state((0, 0.3, 0), 0, held=True)] * 2),
        "rest states",
    ),
    "an index too high": ("wells", _at(*STATES, 0, "index", to=1), "rest states"),
    "the index at a stop": ("stop", _at(*STATES, 0, "index", to=1), "rest states"),
    "the index of a held state": ("held", _at(*STATES, 0, "index", to=1), "rest states"),
    "an enclosure beside": ("wells", _at(*STATES, 0, to=state((0, -0.501, 0), 0)), "rest states"),
    "an enclosure that ends just beside": (
        "wells",
        _at(*STATES, 0, to=state((0, -0.5 + 1.5 * EXACT, 0), 0)),
        "rest states",
    ),
    "an enclosure beside, on the plane": (
        "plane",
        _at(*STATES, 0, to=state((0.5 - 6 / 34 + 5e-3, 0.5 - 10 / 34 - 3e-3, 0), 0, held=True)),
        "rest states",
    ),
    "a double zero": ("flat", _at(*STATES, to=[state((0, 0, 0), 0)]), "rest states"),
    "an enclosure of two": ("wells", _at(*LOW, to=[-1e-13, -0.6, -1e-13]), "rest states"),
    "an enclosure upside down": ("wells", _at(*LOW, to=[1e-3, -0.5, 0.0]), "record"),
    "held where nothing jumps": ("wells", _at(*STATES, 0, "held", to=True), "rest states"),
    "not held where it jumps": ("held", _at(*STATES, 0, "held", to=False), "rest states"),
    "a ridge that pulls": (
        "held",
        _at(*STATES, to=[state((0, 0.3, 0), None, held=True, ridge=True)]),
        "rest states",
    ),
    "no ridge that pushes": ("ridge", _at(*STATES, 2, "ridge", to=False), "rest states"),
    "held at a stop from which U rises": (
        "stop",
        _factor("-5", "5"),
        "rest states",
    ),
    "held at a stop, where U rises": (
        "inside",
        _at(*STATES, to=[state((0, 0, 0), 0), state((0, 0.9, 0), 0, held=True)]),
        "rest states",
    ),
    "the index on a sphere": ("sphere", _at(*STATES, 0, "index", to=1), "rest states"),
    # the list
    "an undecided box beside": ("unfinished", _at("ranges", 0, "undecided", to=[BOX]), "no other"),
    "too many boxes": ("unfinished", _at("ranges", 0, "undecided", to=[BOX] * 1000), "record"),
    "a huge enclosure": ("wells", _at(*LOW, to=[-1e308, -0.5, 0.0]), "rest states"),
    "ends that leave out a coupled state": (
        "coupled",
        lambda record: changed(
            changed(record, "ranges", 1, "end", 0, to=0.1), "ranges", 1, "states", to=[]
        ),
        "ends",
    ),
    "all, with undecided boxes": ("lean", _at("ranges", 0, "undecided", to=[BOX]), "rest states"),
    "a range that ends early": ("wells", _at("ranges", 0, "end", 0, to=3.0), "record"),
    "a range that is half": ("wells", _at("ranges", 0, "end", 1, to="1"), "record"),
    "a range beyond the stop": ("stop", _at("ranges", 0, "end", 1, to="pi/2"), "record"),
    "ends that leave it out": ("lean", _at("ranges", 1, "end", 0, to=0.6), "ends"),
    "no ranges": ("wells", _at("ranges", to=[]), "record"),
    # levels and faces
    "a level 1 % too high": (
        "lean",
        _at("ranges", 0, "level", to=LEAST + 1.01 * BORDER),
        "certified region",
    ),
    "a level above a valley": ("valley", _at("ranges", 0, "level", to=BORDER + 1e-6), "certified"),
    "a region too high": ("wells", _at("ranges", 0, "regions", to=[[0, 1.01]]), "region of rest"),
    "a region over a ridge": ("tent", _at("ranges", 0, "regions", to=[[0, 1e-3]]), "region of"),
    "a region through a jump": ("through", _at("ranges", 0, "regions", to=[[0, 1.2]]), "region of"),
    "a region of a pass": ("wells", _at("ranges", 0, "regions", to=[[2, 0.9]]), "region of rest"),
    "the level of all for one of two": (
        "wells",
        _at("ranges", 0, "level", to=0.5),
        "certified region",
    ),
    "a face closed by nothing": ("lean", _at("energy", "closed", to=[1]), "barrier"),
    "a face closed by a well": ("barrier", _factor("5", "-5"), "barrier"),
    "a barrier that is too weak": ("barrier", lambda _: weak(), "barrier"),
    "a barrier on another angle": ("barrier", _at("energy", "closed", to=[0, 1]), "barrier"),
    "a face closed by a well at θ3": ("outer", _factor("4", "-4"), "barrier"),
    "every start, with a face that is open": ("outer", _at("energy", "closed", to=[0, 1]), "every"),
    "every start, without a barrier": (
        "lean",
        _at("ranges", 1, "every_start", to=True),
        "every start",
    ),
    "every start, with a wrong list": (
        "barrier",
        _at("ranges", 1, "states", to=[state((0.1, 0, 0), 0)]),
        "every start",
    ),
    # operations
    "a ligament without a toe": (
        "ligament",
        _operation(["pow", 3, 16], ["pow", 2, 16]),
        "switches",
    ),
    "a toe that ends with a jump": (
        "ligament",
        _operation(["pow", 3, 19], ["pow", 2, 19]),
        "switches",
    ),
    "a load that is lost": ("ligament", _factor("8", "0"), "rest states"),
    "a plane at which U jumps": ("plane", _factor("3", "1"), "switches"),
    "a sign": ("wells", _factor("-8", "8"), "rest states"),
    "a sine for a cosine": ("lean", _operation(["sin", 0], ["cos", 0]), "rest states"),
    "smoother than it is": ("held", _operation(["step", 1, 3], ["step", 2, 3]), "switches"),
    "an operation ahead": ("lean", _operation(["sin", 0], ["sin", 9]), "record"),
    "a function that is none": ("lean", _operation(["sin", 0], ["tan", 0]), "record"),
    "not convex in z": ("own_state", _factor("4", "-4"), "convexity"),
    "z that nothing holds": ("own_state", _factor("10", "-10"), "convexity"),
    "another format": ("wells", _at("format", to=2), "record"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_records_are_refused(records, name):
    case, change, claim = WRONG[name]
    assert any(refusal.startswith(claim) for refusal in refused(change(records[case])))


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("angle", [0, 1, 2])
def test_each_face_of_the_border_limits_the_level(angle, sign):
    true = tilted(angle, sign)
    level = true["ranges"][0]["level"]

    def both(height: float) -> Record:
        record = changed(true, "ranges", 0, "level", to=height)
        return changed(record, "ranges", 0, "regions", to=[[0, height]])

    kept = ("ranges", 0, "kept")
    assert refused(changed(true, *kept, to=level)) == []
    assert refused(changed(true, *kept, to=level + 0.01)) == ["range"]
    assert refused(both(level)) == []
    assert refused(both(level + 0.01)) == ["certified region", "region of rest state 1"]
