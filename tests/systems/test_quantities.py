"""Stored quantities have names of their own, known dimensions, and consistent units."""

from rbstab.systems.quantities import BY_NAME, QUANTITIES


def test_names_are_found_and_belong_to_one_quantity():
    assert len(BY_NAME) == len(QUANTITIES)
    assert all(BY_NAME[quantity.name] is quantity for quantity in QUANTITIES)


def test_axes_are_those_of_a_run():
    known = {
        (),
        ("axis",),
        ("time",),
        ("time", "axis"),
        ("time", "part"),
        ("time", "element", "axis"),
        ("switch",),
        ("transition",),
        ("impact",),
        ("rest",),
    }
    assert {quantity.dimensions for quantity in QUANTITIES} == known


def test_units_of_rates_are_units_over_seconds():
    per_second = {"rad": "rad/s", "m": "m/s", "J": "W"}
    for quantity, rate in (
        ("orientation", "angular_velocity"),
        ("position", "velocity"),
        ("contact_displacement", "contact_velocity"),
        ("constraint_position_residual", "constraint_velocity_residual"),
        ("lyapunov", "lyapunov_rate"),
        ("energy", "dissipation"),
    ):
        assert BY_NAME[rate].unit == per_second[BY_NAME[quantity].unit]


def test_energies_are_in_joule():
    energies = ("lyapunov", "lyapunov_change", "energy", "energy_residual", "contact_work")
    assert {BY_NAME[name].unit for name in (*energies, "energy_at_rest")} == {"J"}


def test_every_quantity_says_what_it_is():
    assert all(quantity.symbol and quantity.unit and quantity.meaning for quantity in QUANTITIES)
