"""Lists of rest states from four charts: against other equations, and wrong programs."""

from dataclasses import replace
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
from support.rotations import (
    energy_of_mounts,
    four_mounts,
    negative_directions,
    stationary_points,
    traced,
    zero_of_chart,
)

from rbstab.proof.rotations import charts
from rbstab.proof.rotations.charts import same, searched_states
from rbstab.proof.rotations.energy import RotationEnergy
from rbstab.proof.rotations.lists import rest_rotations
from rbstab.proof.rotations.states import Rotations
from rbstab.proof.search import Search, Zeros

LIMIT = 40_000


class Recorded(NamedTuple):
    energy: RotationEnergy
    zeros: list[Zeros]
    listed: Rotations


@pytest.fixture(scope="module")
def recorded():
    """The search for the rest states of the machine on mounts, and the zeros of each chart."""
    energy, zeros = traced(four_mounts()).energy, list[Zeros]()

    class Recording(Search):
        def run(self, limit):
            zeros.append(super().run(limit))
            return zeros[-1]

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(charts, "Search", Recording)
        return Recorded(energy, zeros, rest_rotations(energy, LIMIT))


@pytest.mark.heavy
def test_a_search_with_other_equations_finds_no_other_state_of_the_mounts(recorded):
    """Its half turns have 960, 1440 and 2400 J, by hand: Σ ½ (K_y + ...) (2 · 0.2)², say."""
    mounts = recorded.listed
    assert mounts.proved
    assert mounts.counts == [2, 4, 4, 2]
    half_turns = [energy_of_mounts(np.diag(d)) for d in ([1, -1, -1], [-1, 1, -1], [-1, -1, 1])]
    assert half_turns == pytest.approx([960, 1440, 2400])
    listed = [state.rotation for state in mounts.states]
    seen = set()
    for A in stationary_points(energy_of_mounts, 40, seed=4):
        away = [np.abs(A - B).max() for B in listed]
        assert min(away) < 1e-4
        seen.add(int(np.argmin(away)))
    assert len(seen) >= 8
    for state in mounts.states:
        assert energy_of_mounts(state.rotation) == pytest.approx(state.energy, abs=1e-6)
        assert negative_directions(energy_of_mounts, state.rotation) == state.index


def listed_again(monkeypatch, recorded, **changed):
    """The list from the zeros of all charts, with parts of the program changed."""
    zeros = iter(recorded.zeros)
    monkeypatch.setattr(
        charts, "Search", lambda *_, **__: SimpleNamespace(run=lambda _: next(zeros))
    )
    for name, change in changed.items():
        monkeypatch.setattr(charts, name, change)
    return searched_states(recorded.energy, LIMIT)


PLAIN = charts._state


def index_of_three_is_zero(*of):
    state = PLAIN(*of)
    assert state is not None
    return replace(state, index=state.index % 3)


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("changed", "why"),
    [
        ({"CHARTS": range(3)}, "index 3"),
        ({"_state": index_of_three_is_zero}, "index 3"),
        ({"same": lambda *_: None}, "whether two rest states are the same"),
        ({"_state": lambda *_: None}, "whether a rest state is stable"),
    ],
)
def test_wrong_programs_are_noticed(monkeypatch, recorded, changed, why):
    assert recorded.listed.proved
    listed = listed_again(monkeypatch, recorded, **changed)
    assert not listed.proved
    assert why in listed.why


def test_same_and_different_and_not_known():
    # q = (1, 0.5, 0.2, -0.4) in the charts 0 and 1.
    first, second = zero_of_chart(0, [0.5, 0.2, -0.4]), zero_of_chart(1, [2, 0.4, -0.8])
    assert same(first, second) is True
    assert same(first, zero_of_chart(1, [2, 0.4, 0.8])) is False
    # Its enclosure meets that of the other, and is not where the other is the only one.
    assert (
        same(
            zero_of_chart(0, [0.5, 0.2, -0.4], 1e-3, 1e-3),
            zero_of_chart(1, [2, 0.4, -0.7985], 1e-3, 1e-3),
        )
        is None
    )
    # q1 = 0 in chart 0, and q0 = 0 in chart 1: half a turn apart.
    assert same(zero_of_chart(0, [0, 0.1, 0]), zero_of_chart(1, [0, 0.1, 0])) is False
    assert same(first, zero_of_chart(0, [0.5, 0.2, -0.4])) is True
    assert same(first, zero_of_chart(0, [0.5, 0.2, -0.3])) is False
