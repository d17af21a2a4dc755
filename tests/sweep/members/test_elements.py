"""Sweeps over numbers of elements: batches agree with single runs, columns have units."""

from typing import Any

import h5py
import numpy as np
import pytest
from support.config_elements import EACH_KIND, TIE, config_data
from support.member_plans import ELEMENTS

from rbstab.config.build import problem_of
from rbstab.config.errors import ConfigError
from rbstab.integrate.heyoka.symbols import parameters_and_start
from rbstab.sweep.folder.sweep_table import open_sweep, read_sweep
from rbstab.sweep.members.binding import Binding
from rbstab.sweep.members.engines import factory_for
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.options import SweepOptions
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.sweep import sweep_to_folder

SHORT: dict[str, Any] = {"duration": 0.3, "samples": 16, "rtol": 1e-12, "engine": "heyoka"}


def plan_of(vary=None, base=None, members=12, **changes):
    base = base or config_data(integration=SHORT)
    design = {"design": "random", "members": members, "seed": 3}
    return load_plan(
        {"title": "Elements", "base": base, "vary": vary or ELEMENTS, **design, **changes}
    )


def test_numbers_of_members_are_those_of_their_configs():
    plan = plan_of()
    binding = Binding(plan, "free")
    values = plan.values(0, 12)
    parameters, starts = binding.parameters_and_starts(values)
    for k in (0, 11):
        config = plan.config_of(k)
        problem = problem_of(config)
        expected = parameters_and_start(problem.system, problem.start)
        numbers = np.concatenate([parameters[:, k], starts[:, k]])
        assert numbers == pytest.approx(expected, rel=1e-15, abs=1e-300)
        bound = binding.config_of({key: column[k] for key, column in values.items()})
        assert bound.elements == config.elements
        assert config.elements["strut"].stiffness == values["elements.strut.stiffness"][k]
        assert config.elements["strut"].point[2] == values["elements.strut.point[2]"][k]
        factor = values["elements.tie.K_c"][k]
        assert config.elements["tie"].K_c[0][1] == factor * 100.0


@pytest.mark.parametrize("gravity", [[0.0, 0.0, -9.81], [0.0, 0.0, 0.0]], ids=["heavy", "floating"])
def test_rest_states_are_those_of_single_runs(gravity):
    """Elements pull a body off the unloaded position, without gravity too; it stays near."""
    slow = {"orientation": [0.0, 0.0, 0.0], "angular_velocity": [0.02, 0.0, 0.01]}
    base = config_data({"tie": TIE}, gravity=gravity, initial=slow, integration=SHORT)
    plan = plan_of({"elements.tie.K_c": {"scale": {"uniform": [0.5, 2]}}}, base, 3)
    batch = factory_for("heyoka")(plan).compute(0, 3).outcome
    expected = SingleRuns(plan, "scipy").compute(0, 3).outcome
    assert (np.abs(expected["energy_at_rest"]) > 0.1).all()
    assert np.abs(batch["final_position"]).max() < 0.2
    for name in ("energy_at_rest", "rest_orientation", "lyapunov_start", "lyapunov_end"):
        scale = np.abs(expected[name]).max()
        np.testing.assert_allclose(batch[name], expected[name], rtol=0, atol=1e-8 * scale)


def test_columns_of_numbers_of_elements_have_units(tmp_path):
    options = SweepOptions(shard_size=4, threads=1, compare=2)
    assert sweep_to_folder(plan_of(), tmp_path, options).finished
    table = read_sweep(tmp_path)
    assert table.attributes["checked_unlike"] == 0
    assert max(table["check_difference"]) < 1e-8
    with h5py.File(tmp_path / "members.h5") as file:
        units = {name: file[name].attrs["units"] for name in file if name.startswith("elements")}
    assert units["elements_strut_stiffness"] == "N/m"
    assert units["elements_strut_point_2"] == "m"
    assert units["elements_upright_L_0"] == "N m s/rad"
    assert units["elements_range_stiffness"] == "N m"
    assert units["elements_tie_K_c"] == units["elements_strut_damping"] == "1"  # factors
    assert len(units) == len(ELEMENTS)
    assert open_sweep(tmp_path)["elements_tie_anchor_1"].shape == (12,)


STRUT = "elements.strut"


@pytest.mark.parametrize(
    ("key", "values", "expected"),
    [
        (f"{STRUT}.stifness", [1], f"is not in the base (did you mean {STRUT}.stiffness?)"),
        ("elements.strat.damping", [1], f"is not in the base (did you mean {STRUT}.damping?)"),
        (f"{STRUT}.point[3]", [1], f"is not in the base (did you mean {STRUT}.point[2]?)"),
        ("elements.tie.stiffness", [1], "is not in the base (expected a key of the config)"),
        ("elements.rope.stiffness", [1], "is not in the base"),
        (f"{STRUT}.kind", [1, 2], "expected a number"),
        (f"{STRUT}.point", [1, 2], "expected one entry"),
        (f"{STRUT}.stiffness", [1, -2], f"{STRUT}.stiffness is -2"),
    ],
)
def test_what_cannot_vary_is_named_with_a_hint(key, values, expected):
    with pytest.raises(ConfigError) as caught:
        plan_of({key: {"values": values}})
    (problem,) = caught.value.problems
    assert f"vary.{key}: " in str(problem)
    assert expected in str(problem)


def test_every_number_of_every_kind_can_vary():
    keys = {
        "strut": ["point[0]", "anchor[1]", "stiffness", "rest_length", "damping"],
        "tie": ["point[1]", "anchor[1]", "K_c[0][0]", "L_c[2]"],
        "upright": ["K[0]", "L[2]"],
        "range": ["stiffness", "outer_stiffness"],
    }
    assert set(keys) == set(EACH_KIND)
    varied = [f"elements.{name}.{key}" for name, numbers in keys.items() for key in numbers]
    for key in varied:
        plan = plan_of({key: {"scale": {"uniform": [1.0, 1.01]}}}, members=2)
        first, second = plan.config_of(0), plan.config_of(1)
        assert first.elements != second.elements, key
