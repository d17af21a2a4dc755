"""Protects the choice of compared members: the plan decides it, and few members show faults."""

import numpy as np
import pytest
from support.paper_runs import paper_config

from rbstab.integrate.heyoka import ensemble
from rbstab.integrate.heyoka.symbols import parameter_values
from rbstab.sweep.folder.scipy_comparison import _NOT_COMPARED, compare, members_to_compare
from rbstab.sweep.members.binding import Binding
from rbstab.sweep.members.ensemble import ensemble_engine
from rbstab.sweep.members.outcome import COLUMNS
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.plan.load import load_plan
from rbstab.systems.parameters import parameters

SPIN = [f"initial.angular_velocity[{axis}]" for axis in range(3)]


def plan_of(vary, settings=None, **design):
    base = paper_config("visco-elastic", **(settings or {}))
    return load_plan({"base": base, "vary": vary, **design})


def grid(*counts):
    return plan_of({SPIN[k]: {"linspace": [-40, 40, n]} for k, n in enumerate(counts)})


@pytest.mark.parametrize("counts", [(3,), (20,), (300, 300), (301, 201), (1000, 1000)])
def test_four_members_are_spread_over_a_plan(counts):
    """No two are in one row or column of a grid, and the plan has no long piece without one."""
    plan = grid(*counts)
    chosen = members_to_compare(plan)
    assert len(chosen) == min(4, plan.members)
    for values in plan.values(0, plan.members).values():
        assert len(set(values[chosen].tolist())) == len(chosen)
    gaps = np.diff([0, *chosen, plan.members - 1])
    assert gaps.max() <= plan.members / 2


def test_no_error_of_a_column_is_compared():
    assert {name for name in COLUMNS if name.endswith("_error")} <= set(_NOT_COMPARED)


def test_every_variant_is_compared_but_sliding():
    names = ["free", "sliding", "permanent", "visco-elastic", "embedded"]
    base = paper_config("embedded")
    base["controller"] |= {"K_s": [2000.0] * 3, "surface": {"slope": 20.0}}
    base["controller"].pop("variant")
    for repeated in (1, 2000):
        vary = {
            "controller.variant": {"each": {"values": names}},
            SPIN[0]: {"uniform": [-40, 40]},
        }
        plan = load_plan(
            {"base": base, "vary": vary, "design": "random", "members": 3 * repeated, "seed": 1}
        )
        chosen = members_to_compare(plan)
        variants = [plan.values(k, k + 1)["controller.variant"][0] for k in chosen]
        assert sorted(variants) == sorted(set(names) - {"sliding"})
        assert len(members_to_compare(plan, 9)) == 9
    base["controller"] = {"variant": "sliding", "K_s": [2000.0] * 3, "surface": {"slope": 20.0}}
    sliding = load_plan({"base": base, "vary": {SPIN[0]: {"linspace": [0, 1, 5]}}})
    assert members_to_compare(sliding) == []


def test_more_members_may_be_asked_for():
    plan = grid(100, 100)
    chosen = members_to_compare(plan, 500)
    assert chosen == sorted(set(chosen))
    assert len(chosen) == 500
    assert set(members_to_compare(plan, 9)) <= set(chosen)
    assert members_to_compare(grid(7), 100) == list(range(7))


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        ([1.0, 1.0], [1.0, 2.0], 0.5),
        ([np.inf, 1.0], [np.inf, 2.0], 0.5),
        ([np.inf, 2.0], [5.0, 2.0], 0),
    ],
)
def test_infinite_numbers_hide_no_difference(first, second, expected):
    """They come from diverged motions."""
    columns = [
        {"status": np.zeros(2), "settling_time": np.array(values)} for values in (first, second)
    ]
    assert compare(*columns) == (0, {"settling_time": expected})


def test_members_that_end_otherwise_are_counted_and_not_compared():
    """The second has another status, and the third has settled in one of both only."""
    first = {"status": np.array([0, 1, 0, 0]), "settling_time": np.array([1.0, 2.0, np.nan, 4.0])}
    second = {"status": np.zeros(4), "settling_time": np.array([1.0, 9.0, 3.0, 4.0])}
    assert compare(first, second) == (2, {"settling_time": 0.0})


@pytest.mark.parametrize(
    ("name", "scale", "values", "expected"),
    [
        # At rest both are round-off: of 8 J, of a peak of 2 rad/s, or where nothing ever moved.
        ("lyapunov_end", "energy_scale", (4e-16, -4e-16, 8.0), 1e-16),
        ("energy_residual", "energy_scale", (4e-15, 0.0, 8.0), 5e-16),
        ("lyapunov_start", "energy_scale", (0.0, 1e-17, 8.0), 1e-17 / 8),
        ("final_velocity", "largest_velocity", (1e-12, -1e-12, 2.0), 1e-12),
        ("final_velocity", "largest_velocity", (1e-17, -1e-17, 1e-17), 2e-9),
        # A wrong end is seen.
        ("lyapunov_end", "energy_scale", (1e-3, 2e-3, 8.0), 1.25e-4),
        ("final_velocity", "largest_velocity", (0.1, 0.2, 2.0), 0.05),
    ],
)
def test_differences_are_relative_to_a_peak(name, scale, values, expected):
    first, second, size = values
    shape = (2, 3) if name.startswith("final") else (2,)
    columns = [
        {"status": np.zeros(2), name: np.full(shape, value), scale: np.full(shape, size)}
        for value in (first, second)
    ]
    unlike, differences = compare(*columns)
    assert unlike == 0
    assert differences[name] == pytest.approx(expected)


# Broken engines

FEW = plan_of(
    {SPIN[0]: {"uniform": [-20, 20]}, "body.mass": {"uniform": [30, 60]}},
    {"duration": 0.5, "samples": 51},
    design="random",
    members=64,
    seed=2,
)
TOLERANCE = 1e-8
"""Both engines agree to 1e-12 of the largest number of each column. Peaks and settling times are
found on the steps, which differ: they agree to 1e-9."""


@pytest.fixture(scope="module")
def theirs():
    """The outcomes of all members by single runs of SciPy, which are right."""
    return SingleRuns(FEW, "scipy", with_largest=True).compute(0, FEW.members).outcome


def difference(theirs, members):
    """Return the largest difference of the ensemble engine, for some members."""
    batch = ensemble_engine(FEW).compute(0, FEW.members).outcome
    unlike, differences = compare(
        *(
            {name: column[members] for name, column in outcome.items()}
            for outcome in (batch, theirs)
        )
    )
    return np.inf if unlike else max(differences.values())


def test_an_engine_without_a_fault_agrees(theirs):
    assert difference(theirs, list(range(64))) < 3e-9


SYSTEM = FEW.initial_value_problems["visco-elastic"].system
COMPILED_IN = np.flatnonzero(~Binding(FEW, "visco-elastic").varies).tolist()
"""The numbers of the system that are the same for all members."""


@pytest.mark.slow
@pytest.mark.parametrize(
    "number",
    # Each takes a compilation.
    [
        n if k % 6 == 0 else pytest.param(n, marks=pytest.mark.long)
        for k, n in enumerate(COMPILED_IN)
    ],
)
def test_a_number_that_is_compiled_in_wrong_shows_in_four_members(number, theirs, monkeypatch):
    """Each number in turn is wrong by a millionth, or is not zero where it should be.

    Then it is 0.001, or a millionth of the largest entry of its matrix if that is more: a coupling
    of 0.001 N/m beside K_c = 12,300 N/m changes no column by 1e-8, and so need not show.
    """

    def wrong(given):
        values = parameter_values(given)
        sizes = np.concatenate(
            [np.full(v.size, np.abs(v).max()) for v in parameters(given).values()]
        )
        values[number] += (
            1e-6 * values[number] if values[number] else max(1e-3, 1e-6 * sizes[number])
        )
        return values

    monkeypatch.setattr(ensemble, "parameter_values", wrong)
    assert difference(theirs, members_to_compare(FEW)) > TOLERANCE


FAULTS = {
    "a varied number is ignored": lambda numbers: np.repeat(numbers[:, :1], numbers.shape[1], 1),
    "a factor is wrong": lambda numbers: numbers * (1 + 1e-6),
    "members are shifted by one": lambda numbers: np.roll(numbers, 1, axis=1),
    "members are in reverse order": lambda numbers: numbers[:, ::-1],
    "single precision": lambda numbers: numbers.astype("f4").astype(float),
}


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("which", [0, 1])
def test_a_wrong_binding_shows_in_four_members(fault, which, theirs, monkeypatch):
    """The varied starts or parameters of the members are wrong."""
    right = Binding.parameters_and_starts

    def wrong(self, values):
        parts = list(right(self, values))
        parts[which] = FAULTS[fault](parts[which])
        return tuple(parts)

    monkeypatch.setattr(Binding, "parameters_and_starts", wrong)
    assert difference(theirs, members_to_compare(FEW)) > TOLERANCE
