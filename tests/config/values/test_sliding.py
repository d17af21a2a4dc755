"""Keys of the sliding variant: surfaces, laws, and the switching that they select."""

import pytest
from support.configs import VISCO_ELASTIC, edited

from rbstab.config.build import problem_of
from rbstab.config.warnings import config_warnings

TEXT = edited("variant: visco-elastic", "variant: sliding")
TEXT = "\n".join(line for line in TEXT.splitlines() if "_c:" not in line) + "\n"
TEXT = edited("  K_t:", "  K_s: [1, 2, 3]\n  surface: position\n  K_t:", TEXT)


def test_laws_and_what_they_switch(load):
    laws = {
        "law: exact": (False, 0.0),
        "law: {boundary_layer: 0.5}": (True, 0.0),
        "law: {implicit: 0.25}": (False, 0.25),
    }
    for line, (layered, step) in laws.items():
        switching = problem_of(load(edited("  K_t:", f"  {line}\n  K_t:", TEXT))).switching
        assert switching is not None
        assert (switching.layered, switching.step) == (layered, step)
    assert problem_of(load(VISCO_ELASTIC)).switching is None


def test_a_step_longer_than_the_samples_are_apart_is_warned_of(load):
    for h, warned in ((0.02, True), (0.01, False)):
        text = edited("  K_t:", f"  law: {{implicit: {h}}}\n  K_t:", TEXT)
        config = load(text, "integration.duration=1", "integration.samples=101")
        assert any("steps of 0.01 s are used" in line for line in config_warnings(config)) == warned


@pytest.mark.parametrize(
    "line", ["surface: {slope: 20}", "law: {implicit: 1.0e-3}", "law: {boundary_layer: 1.0e-3}"]
)
def test_no_sticking_may_be_written_with_every_surface_and_law(load, line):
    """Zero is the default, so a resolved config contains it."""
    text = TEXT if line.startswith("law") else edited("  surface: position\n", "", TEXT)
    config = load(edited("  K_t:", f"  {line}\n  stick_energy: 0\n  K_t:", text))
    assert config.controller.stick_energy == 0.0
