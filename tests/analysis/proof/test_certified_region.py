"""The certified region is bounded by the lowest border point or other rest state, with proof."""

from dataclasses import replace

import numpy as np
import pytest
from support.proofs import rest_states
from support.rest import DAMPING, HEAVY, K_R, inverted_pendulum, paper_system, random_rest_system

from rbstab.analysis.proof.boxes import RANGE_END
from rbstab.analysis.proof.certified_region import Face, certified_region
from rbstab.analysis.proof.outcome import SearchOutcome
from rbstab.analysis.proof.reduced_energy import reduced_energy
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.translational_stabilizer import TranslationalStabilizer


def region_of(rest, **options):
    """Return the region of at least one rest state."""
    found = certified_region(rest, **options)
    assert found is not None
    return found


def region(system, **options):
    """Return the region of a system."""
    return region_of(rest_states(system, **options))


def border_points(rng, face, count=20_000):
    axis, sign = face.value
    points = rng.uniform(-RANGE_END, RANGE_END, size=(count, 3))
    points[:, axis] = sign * RANGE_END[axis]
    return points


# Known values, rounded to a joule.
@pytest.mark.parametrize(
    ("variant", "least"), [("free", 493), ("permanent", 1020), ("visco-elastic", 918)]
)
def test_least_energy_where_the_angles_become_singular(variant, least):
    found = region(paper_system(variant))
    assert found.proved
    assert found.face in {Face.THETA2_LOW, Face.THETA2_HIGH}
    assert found.level == pytest.approx(least, abs=0.5)
    assert found.level - 1e-5 < found.lower_bound <= found.level
    # Without a load the energy at rest is zero.
    assert found.energy == found.level


def test_free_body_needs_a_quarter_turn():
    found = region(paper_system("free"))
    # ½ K (π/2)² of the softest axis: 400 N m/rad on θ2.
    assert found.level == pytest.approx(0.5 * 400 * (np.pi / 2) ** 2, rel=1e-14)
    assert abs(found.attained_at[1]) == pytest.approx(np.pi / 2, rel=1e-15)
    np.testing.assert_allclose(found.attained_at[[0, 2]], 0, atol=1e-7)


def test_of_faces_that_are_alike_the_first_counts():
    # θ3 = π and -π are one attitude; only the coupling of θ3 with θ1 makes their energies differ.
    soft = paper_system("permanent", 0.1)
    lower = []
    for coupling in (4e-11, -4e-11):
        K_r = 0.1 * K_R
        K_r[0, 2] = K_r[2, 0] = coupling
        coupled = RotationalStabilizer(K_r, DAMPING)
        elements = [coupled if type(e) is type(coupled) else e for e in soft.elements]
        found = region(replace(soft, elements=tuple(elements)))
        low, high = found.faces[Face.THETA3_LOW].value, found.faces[Face.THETA3_HIGH].value
        lower.append(low < high)
        assert found.energy == min(low, high)
        assert found.face is Face.THETA3_LOW
    assert lower == [True, False]


def test_level_is_counted_from_the_rest_state():
    light, heavy = region(paper_system("free")), region(paper_system("free", weight=HEAVY))
    # The weight shifts the energy of all attitudes of a free body by the same amount.
    assert heavy.level == pytest.approx(light.level, rel=1e-12)
    assert heavy.energy == pytest.approx(light.energy - 25.625, rel=1e-12)
    assert heavy.lower_bound == pytest.approx(heavy.level, rel=1e-9)


def test_level_does_not_depend_on_where_energy_is_counted_from():
    # The anchor lies a kilometre below: the weight has done work of 4e5 J, and K_t stores none.
    near = paper_system("permanent", weight=HEAVY)
    loose = TranslationalStabilizer(np.zeros((3, 3)), DAMPING)
    near = replace(near, elements=(near.elements[0], loose, near.elements[2]))
    far = replace(near, anchor=np.array([0.0, 0.0, -1e3]))
    one, other = region(near), region(far)
    assert one.energy - other.energy == pytest.approx(4.1e5, rel=1e-6)
    assert one.level == pytest.approx(other.level, rel=1e-9)
    assert other.level - 1e-5 < other.lower_bound <= other.level
    # The round-off of both energies is subtracted.
    energy = reduced_energy(far).form
    assert other.lower_bound < other.level - 1.9 * energy.round_off[0]


@pytest.mark.parametrize("variant", ["permanent", "visco-elastic", "embedded"])
def test_border_and_other_rest_states_are_not_lower(rng, variant):
    rest = rest_states(random_rest_system(rng, variant))
    found = region_of(rest)
    form, lowest = rest.energy.form, rest.states[0].state.energy
    assert found.proved
    for face in Face:
        samples = form.value(border_points(rng, face))
        assert samples.min() >= found.lower_bound + lowest
        least = found.faces[face]
        assert least.closed
        assert samples.min() >= least.lower_bound
        assert abs(least.Theta[face.value[0]]) == pytest.approx(RANGE_END[face.value[0]])
    for other in rest.states[1:]:
        assert other.state.energy >= found.energy
        assert other.state.energy - lowest >= found.lower_bound
    (attained,) = form.value(found.attained_at[np.newaxis])
    assert attained == pytest.approx(found.energy, rel=1e-10, abs=1e-10)
    assert found.lower_bound == pytest.approx(max(found.level, 0.0), abs=1e-6 * samples.max())


def test_other_rest_state_can_be_the_limit():
    # θ2 is stiff, and a half turn of θ1 costs more than crossing the top at θ1 = 0.
    found = region(inverted_pendulum([10.0, 1e3, 1e3], 100.0))
    assert found.proved
    assert found.face is None
    np.testing.assert_allclose(np.sort(np.abs(found.attained_at[1:])), 0, atol=1e-12)
    # Two rest states have the same energy, so the region about one of them is empty.
    assert found.level == pytest.approx(0, abs=1e-10)
    assert 0 <= found.lower_bound < 1e-9


def test_rest_state_on_top_of_the_hill_is_the_limit_of_a_valley():
    # The weight is tilted, so one valley is lower, and the other rest states are higher.
    system = inverted_pendulum([30.0, 1e3, 1e3], 100.0)
    gravity = replace(system.elements[0], weight=np.array([0.0, 20.0, -100.0]))
    rest = rest_states(replace(system, elements=(gravity, *system.elements[1:])))
    found = region_of(rest)
    assert [point.index for point in rest.states] == [0, 0, 1]
    assert found.face is None
    np.testing.assert_array_equal(found.attained_at, rest.states[1].Theta)
    assert found.level == pytest.approx(
        rest.states[1].state.energy - rest.states[0].state.energy, rel=1e-12
    )
    assert found.level > 1
    assert found.lower_bound == pytest.approx(found.level, rel=1e-9)


def test_region_is_empty_where_the_border_is_lower_than_rest():
    # The spring of θ2 is too soft: the one rest state is upright, and the body falls over.
    rest = rest_states(inverted_pendulum([150.0, 50.0, 70.0], 100.0))
    assert rest.unique is True
    assert not rest.states[0].stable
    found = region_of(rest)
    assert found.proved
    assert found.level == pytest.approx(25 * (np.pi / 2) ** 2 - 100, rel=1e-12)
    assert found.level < 0
    assert found.lower_bound == 0


def test_search_alone_proves_nothing():
    found = region(paper_system("permanent"), proof=False)
    assert not found.proved
    assert found.lower_bound == 0
    assert found.level == pytest.approx(1020, abs=0.5)


def test_limit_on_boxes_is_handed_on():
    rest = rest_states(paper_system("permanent"))
    found = region_of(rest, box_limit=10)
    assert not found.proved
    assert found.lower_bound < found.level
    stopped = region(paper_system("permanent", 0.01), box_limit=50)
    assert not stopped.proved
    assert 0 <= stopped.lower_bound <= stopped.level


def test_what_is_undecided_at_rest_leaves_no_region():
    rest = rest_states(inverted_pendulum([100.0, 250.0, 70.0], 100.0))
    assert rest.outcome is SearchOutcome.UNDECIDED
    found = region_of(rest)
    assert not found.proved
    assert found.lower_bound == 0


def test_what_is_undecided_high_up_leaves_a_region():
    rest = rest_states(paper_system("permanent"))
    hill = replace(
        rest.undecided, low=np.array([[0.50, 0.5, 0.5]]), high=np.array([[0.51, 0.51, 0.51]])
    )
    found = region_of(replace(rest, undecided=hill, outcome=SearchOutcome.UNDECIDED))
    corners = rest.energy.form.value(np.random.default_rng(0).uniform(0.5, 0.51, size=(1000, 3)))
    assert not found.proved
    assert found.level > corners.min()
    assert 0.9 * corners.min() < found.lower_bound <= corners.min()


def test_lowest_state_whose_index_is_not_proved_has_no_region():
    rest = rest_states(paper_system("permanent"))
    doubtful = replace(rest.states[0], index_proved=False)
    found = region_of(replace(rest, states=(doubtful,)))
    assert found.lower_bound == 0
    assert found.energy_bound is None
    assert found.level == pytest.approx(1020, abs=0.5)


def test_energy_bound_is_the_same_level_in_total_energy(rng):
    for variant in ("permanent", "embedded"):
        rest = rest_states(random_rest_system(rng, variant))
        found = region_of(rest)
        assert found.energy_bound is not None
        height = found.energy_bound - rest.states[0].state.energy
        assert found.lower_bound == pytest.approx(max(height, 0.0), abs=1e-9 * found.level)
        assert found.energy_bound <= found.energy


def test_no_rest_state_no_region():
    rest = rest_states(paper_system("permanent"))
    assert certified_region(replace(rest, states=())) is None


@pytest.mark.parametrize("face", Face)
def test_faces_hold_their_ends(face):
    axis, sign = face.value
    low, high = face.box.low[0], face.box.high[0]
    assert sign * RANGE_END[axis] in {low[axis], high[axis]}
    # The exact π or π/2 lies between the two doubles.
    assert high[axis] == np.nextafter(low[axis], np.inf)
    others = [other for other in range(3) if other != axis]
    np.testing.assert_array_equal(low[others], -RANGE_END[others])
    np.testing.assert_array_equal(high[others], RANGE_END[others])
