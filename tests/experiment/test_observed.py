"""What is observed of the samples by code made from the equations is what numpy computes."""

from pathlib import Path

import numpy as np
import pytest

from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.experiment import record
from rbstab.integrate.deadline import Deadline
from rbstab.integrate.engines import engine
from rbstab.systems.quantities import named_elements

CONFIGS = Path(__file__).parents[2] / "configs"

NAMES = (
    *("paper/case1_permanent", "paper/case3_embedded", "paper/case2_guarded"),
    *("examples/joint", "examples/elements", "examples/driven", "examples/stop"),
    *("examples/sliding_ties", "examples/manifold", "examples/free_gravity"),
    *("examples/sliding/slope_exact_2000", "examples/sliding/position_layer_2000"),
)


def problem(name, samples=23):
    changes = ["integration.engine=heyoka", f"integration.samples={samples}"]
    return problem_of(load_config(CONFIGS / f"{name}.yaml", changes))


@pytest.mark.parametrize("name", NAMES)
def test_samples_are_those_of_the_equations(name):
    given = problem(name)
    trajectory = engine("heyoka")(given)
    observed = record._observed(given.system, trajectory, None)
    systems = trajectory.systems
    names = [element.name for element in given.system.elements]
    for row, (system, y, t) in enumerate(
        zip(systems, trajectory.states, trajectory.times.tolist(), strict=True)
    ):
        seen = system.observe(y, t)
        expected = {
            "orientation": seen.motion.Theta,
            "contact_velocity": seen.motion.F,
            "energy": seen.energy,
            "dissipation": seen.dissipation,
            "contact_force": seen.contact_force,
        }
        if "rotational" in names:
            couple = seen.wrenches[names.index("rotational")].couple
            expected["stabilizing_couple"] = couple
        wrenches = [seen.wrenches[names.index(element)] for element in named_elements(given.system)]
        if wrenches:
            expected["element_force"] = np.array([wrench.force for wrench in wrenches])
            expected["element_couple"] = np.array([wrench.couple for wrench in wrenches])
        if given.system.supplies:
            expected["supplied_power"] = seen.supplied
        for key, value in expected.items():
            scale = max(1e-3, np.abs(observed[key]).max())
            np.testing.assert_allclose(observed[key][row], value, rtol=0, atol=1e-12 * scale)


def test_samples_after_the_deadline_are_left_out():
    given = problem("paper/case1_permanent")
    trajectory = engine("heyoka")(given)
    ticks = iter(range(1000))
    deadline = Deadline(10.0, clock=lambda: float(next(ticks)))
    observed = record._observed(given.system, trajectory, deadline)
    whole = record._observed(given.system, trajectory, None)
    # The clock is read at the start, and before each sample but the first: at the twelfth, it is
    # 1 s late.
    assert {len(array) for array in observed.values()} == {11}
    for key, array in observed.items():
        assert np.array_equal(array, whole[key][:11])
