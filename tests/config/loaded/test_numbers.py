"""Each number of a config is an entry that can be found by its key, and changed."""

import pytest
from support.config_elements import config_data
from support.configs import EMBEDDED, PERMANENT, VISCO_ELASTIC, edited, plain

from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.config.numbers import entries_of, entries_under, replaced, shifted, value_at
from rbstab.systems.parameters import parameters


@pytest.mark.parametrize(
    ("data", "count", "some"),
    [
        (plain(PERMANENT), 4 * 3 + 7 + 6, ("controller.K_t[0]", "body.mass", "body.inertia[2]")),
        (plain(EMBEDDED), 8 * 3 + 7 + 15, ("initial.connector_state[2]",)),
        # Spring 9, tie 6 + 6 + 3, attitude 6, guard 2; four gains, the body, the start.
        (config_data(), 9 + 15 + 6 + 2 + 4 * 3 + 7 + 12, ("elements.tie.K_c[0][1]",)),
    ],
)
def test_each_number_is_an_entry(data, count, some):
    keys = [entry.key for entry in entries_of(load_config(data))]
    assert len(set(keys)) == len(keys) == count
    assert set(some) <= set(keys)


def test_an_entry_beside_the_diagonal_stands_at_two_places():
    text = edited("K_r: [400, 400, 320]", "K_r: [[4, 1, 0], [1, 4, 0], [0, 0, 3]]")
    config = load_config(plain(text))
    entries = entries_under(config, ("controller", "K_r"))
    expected = "[0][0] [0][1] [0][2] [1][1] [1][2] [2][2]"
    assert " ".join(entry.key[-6:] for entry in entries) == expected
    assert entries[1].paths == (("controller", "K_r", 0, 1), ("controller", "K_r", 1, 0))
    assert [len(entry.paths) for entry in entries] == [1, 2, 2, 1, 2, 1]
    changed = replaced(config, dict.fromkeys(entries[1].paths, 0.5))
    assert changed.controller.K_r[:2] == ((4.0, 0.5, 0.0), (0.5, 4.0, 0.0))
    assert changed.body == config.body
    assert hash(changed) != hash(config)


@pytest.mark.parametrize(
    "key", ["controller.K_s", "body.inertia.3", "body.mass.0", "nothing", "elements.other"]
)
def test_a_path_that_leads_nowhere_is_an_error(key):
    path = tuple(int(part) if part.isdigit() else part for part in key.split("."))
    with pytest.raises(LookupError):
        value_at(load_config(plain()), path)


def test_a_moved_config_is_the_one_with_other_numbers():
    given = load_config(plain())
    shift = {("body", "mass"): 9.0, ("controller", "K_c", 1): -300.0}
    expected = load_config(plain(), ["body.mass=50", "controller.K_c[1]=12000"])
    assert shifted(given, shift) == expected
    assert given == load_config(plain())


def test_a_complex_shift_reaches_every_parameter_that_depends_on_the_number():
    data = plain(VISCO_ELASTIC) | {"gravity": [0, 0, -10]}
    config = load_config(data, ["controller.anchor=equilibrium"])
    problem = problem_of(shifted(config, {("body", "mass"): 1e-100j}))
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
