"""Protects the order in which bodies are proved: every beginning covers the whole plan thinly."""

import numpy as np
import pytest
from support.paper_runs import paper_config

from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.proofs.bodies import bodies_of
from rbstab.sweep.proofs.spread_order import MAX_BITS, alternated, spread_order


def grid(*sizes):
    axes = np.meshgrid(*map(np.arange, sizes), indexing="ij")
    return np.stack([axis.ravel().astype(float) for axis in axes], axis=1)


@pytest.mark.parametrize("table", [grid(16, 16), grid(15, 7), grid(1, 9), grid(3, 1, 5, 2)])
def test_each_point_is_there_once(table):
    assert sorted(spread_order(table).tolist()) == list(range(len(table)))


@pytest.mark.parametrize("blocks", [2, 4, 8])
def test_a_beginning_of_a_grid_is_a_coarser_grid(blocks):
    """The first b² points of a 16 x 16 grid are one in each of b x b blocks."""
    table = grid(16, 16)
    begun = table[spread_order(table)[: blocks**2]] // (16 // blocks)
    assert {tuple(block) for block in begun.tolist()} == {
        (float(i), float(j)) for i in range(blocks) for j in range(blocks)
    }


@pytest.mark.parametrize("sizes", [(15, 15), (31, 9), (5, 50), (100,)])
@pytest.mark.parametrize("fraction", [0.1, 0.3, 0.6])
def test_no_corner_is_left_out(sizes, fraction):
    """In a beginning, each half of each axis has from a third to two thirds of the points."""
    table = grid(*sizes)
    begun = table[spread_order(table)[: int(fraction * len(table))]]
    for axis, size in enumerate(sizes):
        share = np.mean(begun[:, axis] < size / 2)
        assert 1 / 3 <= share <= 2 / 3


def test_values_count_by_their_rank():
    table = grid(8, 8)
    assert spread_order(np.exp(table)).tolist() == spread_order(table).tolist()


def test_points_that_share_a_code_take_turns():
    """Of many axes only some bits fit into a code; equal points share it anyway."""
    table = np.repeat(grid(4), 3, axis=0)
    begun = table[spread_order(table), 0]
    for turn in range(3):
        assert sorted(begun[4 * turn : 4 * turn + 4].tolist()) == [0, 1, 2, 3]
    many = np.random.default_rng(1).random((200, MAX_BITS + 1))
    assert sorted(spread_order(many).tolist()) == list(range(200))


def test_nothing_to_order():
    assert spread_order(np.zeros((0, 2))).tolist() == []
    assert spread_order(np.zeros((1, 3))).tolist() == [0]
    assert alternated([]).tolist() == []


def test_orders_advance_by_the_same_fraction():
    found = alternated([np.array([7, 5, 6, 4]), np.array([1, 0])])
    assert found.tolist() == [7, 1, 5, 6, 0, 4]


def test_variants_and_keys_of_a_plan_take_turns():
    base = paper_config("visco-elastic", with_gravity=True, duration=0.1, samples=5)
    vary = {
        "controller.variant": {"values": ["free", "visco-elastic"]},
        "body.mass": {"linspace": [30, 50, 8]},
        "controller.K_r": {"scale": {"linspace": [0.5, 2, 8]}},
    }
    plan = load_plan({"base": base, "vary": vary})
    bodies = bodies_of(plan)
    assert sorted(bodies.order.tolist()) == list(range(128))
    # One eighth: of each variant, one body in each quadrant of masses and gains, twice.
    begun = bodies.first[bodies.order[:16]]
    values = plan.values(0, plan.members)
    seen = [
        (values["controller.variant"][k], values["body.mass"][k] > 40, gain > 1.25)
        for k in begun.tolist()
        for gain in [values["controller.K_r"][k]]
    ]
    assert sorted({found: seen.count(found) for found in seen}.values()) == [2] * 8
