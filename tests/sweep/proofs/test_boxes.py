"""Proofs for many bodies of a sweep at once: each body in a box has what the proof says of it."""

from fractions import Fraction
from threading import Event

import numpy as np
import pytest
from support.sweeping import run_sweep
from sweep.proofs.plans import K_R, SPIN, plan_of

import rbstab
from rbstab.config.numbers import value_at
from rbstab.config.source import key_of
from rbstab.experiment.proof import prove
from rbstab.experiment.proof_cache import proof_for
from rbstab.experiment.robust.bodies import bodies_id
from rbstab.experiment.robust.record import BodiesRecord, bounds_of
from rbstab.store.document import read_model
from rbstab.sweep.members.engines import factory_for
from rbstab.sweep.proofs.boxes import PART_LIMIT, _Boxes, prove_boxes
from rbstab.sweep.proofs.convergence import ProvedConvergence
from rbstab.sweep.sweep import prove_members

L_R = "controller.L_r"
LONG = 600.0
"""s; a slow machine needs more than the default."""

WEAK = {"scale": {"geomspace": [0.02, 1.0, 9]}}


def covered(proofs, members):
    """Return how many proved boxes have each member."""
    counts = np.zeros(members, dtype=int)
    for proof in proofs:
        if proof.record.proved:
            counts[proof.members] += 1
    return counts


def test_one_box_has_all_bodies(tmp_path):
    plan = plan_of({K_R: {"scale": {"linspace": [0.8, 1.2, 9]}}, L_R: WEAK})
    (proof,) = prove_boxes(plan, tmp_path, LONG)
    assert proof.whole
    assert proof.record.proved
    assert proof.members.tolist() == list(range(81))
    for member in (0, 40, 80):
        alone = proof_for(tmp_path / "own", plan.config_of(member), brief=True)
        assert len(alone.states) == 1
        assert 0 < proof.record.level <= alone.regions[0].level
    # The proof is stored: now there is no need to make it.
    assert len(list((tmp_path / "proofs").iterdir())) == 1
    (again,) = prove_boxes(plan, tmp_path, LONG)
    assert again.record == proof.record


def test_each_member_lies_in_the_bounds_of_its_box(tmp_path):
    plan = plan_of(
        {
            "controller.K_c": {"scale": {"geomspace": [0.1, 100, 10]}},
            L_R: {"scale": {"values": [1, 2]}},
        },
        "visco-elastic",
    )
    proofs = prove_boxes(plan, tmp_path, LONG)
    assert len(proofs) > 1
    assert (covered(proofs, plan.members) == 1).all()
    for proof in proofs:
        bounds = {
            tolerance.key: (tolerance.low, tolerance.high) for tolerance in proof.record.tolerances
        }
        for member in proof.members.tolist():
            config = plan.config_of(member)
            for path in [("controller", name, k) for name in ("K_c", "L_r") for k in range(3)]:
                number = Fraction(repr(value_at(config, path)))
                if key_of(path) in bounds:
                    low, high = map(Fraction, bounds[key_of(path)])
                    assert low <= number <= high
                else:
                    fixed = proof.record.sections["controller"][path[1]][path[2]]
                    assert number == Fraction(repr(fixed))


def test_bodies_with_several_rest_states_are_in_no_box(tmp_path):
    """Held by weak stiffnesses, a heavy body can hang down too."""
    weak = {"scale": {"geomspace": [0.05, 1.0, 4]}}
    plan = plan_of({K_R: weak, L_R: {"scale": {"values": [1, 2]}}}, gravity=[0.0, 0.0, -9.81])
    counts = covered(prove_boxes(plan, tmp_path, LONG), plan.members).reshape(4, 2)
    states = [len(prove(plan.config_of(k), search_only=True).states) for k in (0, 2, 4, 6)]
    assert min(states) == 1 < max(states)
    assert (counts[:, 0] == counts[:, 1]).all()
    assert not counts[np.array(states) > 1].any()
    assert counts.any()


UNDECIDED = {K_R: {"scale": {"geomspace": [0.3, 1.0, 5]}}}
"""Bodies of which a few parts of their box decide nothing."""


@pytest.fixture
def undecided(tmp_path):
    """A plan, and the file that says that the box of all its bodies is not decided."""
    plan = plan_of(UNDECIDED, gravity=[0.0, 0.0, -9.81])
    whole = box_of(plan)
    prove_boxes(plan, tmp_path, LONG)
    return plan, BodiesRecord.file(tmp_path, bodies_id(whole[0], bounds_of(whole[1])))


def box_of(plan):
    """Return the box of all bodies of a plan of a permanent body, as it is examined."""
    every = np.arange(plan.members)
    return _Boxes(plan, "permanent", every, plan.values(0, plan.members)).box(every)


def test_what_is_not_decided_is_not_examined_again(undecided, tmp_path, monkeypatch):
    plan, file = undecided
    record = read_model(file, BodiesRecord)
    assert record.proved is None
    assert record.brief
    assert record.parts == PART_LIMIT
    assert record.widest in {tolerance.key for tolerance in record.tolerances}
    first = prove_boxes(plan, tmp_path, LONG)
    monkeypatch.setattr("rbstab.experiment.robust.bodies.prove_within", must_not_be_called)
    again = prove_boxes(plan, tmp_path, LONG)
    assert [box.members.tolist() for box in again] == [box.members.tolist() for box in first]
    assert [box.record for box in again] == [box.record for box in first]


def must_not_be_called(*_arguments):
    raise AssertionError("it is examined again")


def test_start_and_damping_do_not_divide_a_box(tmp_path):
    vary = {SPIN: {"values": [0, 9]}, K_R: {"scale": {"values": [0.9, 1.1]}}, L_R: WEAK}
    vary |= {"gravity[2]": {"values": [-0.1, 0.1]}}
    (proof,) = prove_boxes(plan_of(vary), tmp_path, LONG)
    keys = {f"{key}[{k}]" for key in (K_R, L_R) for k in range(3)} | {"gravity[2]"}
    assert {tolerance.key for tolerance in proof.record.tolerances} == keys


@pytest.mark.parametrize(
    "vary",
    [
        {SPIN: {"values": [1.0, 2.0]}},
        {"controller.variant": {"values": ["free", "permanent"]}},
    ],
)
def test_where_all_members_of_a_variant_share_a_proof_there_is_no_box(vary, tmp_path):
    assert prove_boxes(plan_of(vary), tmp_path, LONG) == []


def test_after_an_interrupt_or_without_time_no_box_is_begun(tmp_path):
    plan, stop = plan_of({K_R: {"scale": {"values": [0.9, 1.1]}}}), Event()
    assert prove_boxes(plan, tmp_path, 0.0) == []
    stop.set()
    assert prove_boxes(plan, tmp_path, 60.0, stop) == []
    assert not (tmp_path / "proofs").exists()


def test_members_of_each_variant_get_what_their_box_says(tmp_path, monkeypatch):
    monkeypatch.setattr("rbstab.sweep.sweep.FEW", 4)
    variants = {"controller.variant": {"values": ["permanent", "free", "visco-elastic"]}}
    gains = {K_R: {"scale": {"linspace": [0.9, 1.1, 4]}}}
    plan = plan_of(variants | gains | {SPIN: {"values": [1.0, 15.0]}}, "visco-elastic")
    sweep = run_sweep(tmp_path / "sweep", plan, threads=1, factory=factory_for("scipy"))
    boxes = {box.variant: box.record for box in prove_members(plan, sweep, budget=0.0).boxes}
    table = rbstab.open_sweep(tmp_path / "sweep")
    words, start = table.words("convergence"), table["lyapunov_start"]
    certified = ProvedConvergence(plan, tmp_path)
    levels, _ = certified.boxes.of(0, plan.members)
    for number, variant in enumerate(("permanent", "free", "visco-elastic")):
        members = slice(8 * number, 8 * number + 8)
        level = boxes[variant].level if variant in boxes else 0.0
        assert (levels[members] == level).all()
        if level:
            below = np.where(start[members] < level, "proved", "unknown")
            assert words[members].tolist() == below.tolist()
            assert set(below) == {"proved", "unknown"}
    assert set(boxes) >= {"permanent", "visco-elastic"}
    # A part of the members has the same levels.
    assert certified.boxes.of(4, 20)[0].tolist() == levels[4:20].tolist()
