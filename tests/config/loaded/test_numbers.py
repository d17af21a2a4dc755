"""Each number of a config is an entry that can be found by its key, and changed."""

import pytest
import yaml
from support.configs import EMBEDDED, PERMANENT, edited, plain

from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.config.numbers import entries_of, entries_under, shifted, value_at
from rbstab.systems.parameters import parameters


def keys(text):
    return [entry.key for entry in entries_of(load_config(yaml.safe_load(text)))]


def test_each_number_of_gains_body_and_start_is_an_entry():
    held = keys(PERMANENT)
    assert len(held) == 4 * 3 + 7 + 6
    assert held[0] == "controller.K_t[0]"
    assert {"body.mass", "body.inertia[2]", "body.contact_point[1]"} <= set(held)
    assert len(keys(EMBEDDED)) == 8 * 3 + 7 + 15
    assert keys(EMBEDDED)[-1] == "initial.connector_state[2]"


def test_an_entry_beside_the_diagonal_stands_at_two_places():
    text = edited("K_r: [400, 400, 320]", "K_r: [[4, 1, 0], [1, 4, 0], [0, 0, 3]]")
    entries = entries_under(load_config(yaml.safe_load(text)), ("controller", "K_r"))
    assert [entry.key[-6:] for entry in entries] == [
        "[0][0]",
        "[0][1]",
        "[0][2]",
        "[1][1]",
        "[1][2]",
        "[2][2]",
    ]
    assert entries[1].paths == (("controller", "K_r", 0, 1), ("controller", "K_r", 1, 0))
    assert [len(entry.paths) for entry in entries] == [1, 2, 2, 1, 2, 1]


@pytest.mark.parametrize(
    "path", [("controller", "K_s"), ("body", "inertia", 3), ("body", "mass", 0), ("nothing",)]
)
def test_a_path_that_leads_nowhere_is_an_error(path):
    with pytest.raises(LookupError):
        value_at(load_config(plain()), path)


def test_a_moved_config_is_the_one_with_other_numbers():
    given = load_config(plain())
    shift = {("body", "mass"): 9.0, ("controller", "K_c", 1): -300.0}
    expected = load_config(plain(), ["body.mass=50", "controller.K_c[1]=12000"])
    assert shifted(given, shift) == expected
    assert given == load_config(plain())


def test_a_complex_shift_reaches_every_parameter_that_depends_on_the_number():
    text = edited("variant: visco-elastic", "variant: visco-elastic\n  anchor: equilibrium")
    data = {**yaml.safe_load(text), "gravity": [0, 0, -10]}
    problem = problem_of(shifted(load_config(data), {("body", "mass"): 1e-100j}))
    touched = {
        name: (value.imag / 1e-100).tolist()
        for name, value in parameters(problem.system).items()
        if value.imag.any()
    }
    # G = m g and X_e = K_t⁻¹ m g.
    assert touched == {
        "body.mass": 1.0,
        "gravity.weight": [0.0, 0.0, -10.0],
        "anchor": [0.0, 0.0, pytest.approx(-10 / 3280, rel=1e-15)],
    }
