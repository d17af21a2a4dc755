"""The defaults of the sliding variant: changed ones would give other runs under the same config."""

from support.configs import edited

from rbstab.config.load import resolved

TEXT = edited("variant: visco-elastic", "variant: sliding")
TEXT = "".join(f"{line}\n" for line in TEXT.splitlines() if "_c:" not in line)
TEXT = edited("  K_t:", "  K_s: [1, 2, 3]\n  surface: position\n  K_t:", TEXT)


def test_keys_of_the_controller(load):
    data = resolved(load(TEXT))["controller"]
    assert data["anchor"] == "origin"
    assert data["law"] == "exact"
    assert data["stick_energy"] == 0.0
    assert data["switch_limit"] == 10_000_000
    assert data["stored_switches"] == 100_000


def test_keys_of_the_integration(load):
    """An exact law takes many more steps than other connectors."""
    data = resolved(load(TEXT))["integration"]
    assert data["coordinates"] == "W"
    assert data["method"] == "DOP853"
    assert data["step_limit"] == 100_000_000


def test_a_sliding_body_starts_at_rest_in_the_origin(load):
    data = resolved(load(edited("  angular_velocity: [16, 32, -16]\n", "", TEXT)))["initial"]
    zero = [0.0, 0.0, 0.0]
    names = ("orientation", "angular_velocity", "position", "velocity")
    assert {name: data[name] for name in names} == dict.fromkeys(names, zero)
