"""Keys of the sliding variant: surfaces, laws, and the switching that they select."""

import pytest
from support.configs import VISCO_ELASTIC, edited

from rbstab.config.build import problem_of
from rbstab.config.warnings import config_warnings

TEXT = edited("variant: visco-elastic", "variant: sliding")
TEXT = "\n".join(line for line in TEXT.splitlines() if "_c:" not in line) + "\n"
TEXT = edited("  K_t:", "  K_s: [1, 2, 3]\n  surface: position\n  K_t:", TEXT)

LAW = "expected exact, {boundary_layer: width} or {implicit: step}"
SURFACE = "expected position or {slope: κ}"

WRONG = [
    ("law: sharp", f"controller.law: 'sharp' is unknown ({LAW})"),
    ("law: 3", f"controller.law: is neither a word nor a mapping ({LAW})"),
    ("law: {implicit: 0}", "controller.law.implicit: is 0 (expected a number greater than 0)"),
    ("law: {implicit: 1, step: 2}", "controller.law.step: is unknown "),
    ("law: {boundary_layer: -1}", "controller.law.boundary_layer: is -1 "),
    (
        "law: {implicit: 1.0e-3}\n  stick_energy: 1",
        "controller.stick_energy: has no effect on this law (expected law: exact)",
    ),
    (
        "law: {boundary_layer: 1.0e-3}\n  stick_energy: 1",
        "controller.stick_energy: has no effect on this law (expected law: exact)",
    ),
]


@pytest.mark.parametrize(("line", "expected"), WRONG)
def test_laws_that_are_refused(complaints, line, expected):
    (message,) = complaints(edited("  K_t:", f"  {line}\n  K_t:", TEXT))
    assert message.split(": ", 1)[1].startswith(expected)


def test_surfaces_that_are_refused(complaints):
    (message,) = complaints(edited("surface: position", "surface: velocity", TEXT))
    assert message.endswith(f"controller.surface: 'velocity' is unknown ({SURFACE})")


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ("[1, -2, 3]", "controller.K_s[1]: is -2 (expected a number greater than 0)"),
        ("[1, 2, 0]", "controller.K_s[2]: is 0 (expected a number greater than 0)"),
        ("[1, 2]", "controller.K_s: has 2 entries (expected 3)"),
        ("[[1, 0, 0], [0, 2, 0], [0, 0, 3]]", "controller.K_s[0]: is a list of 3 "),
    ],
)
def test_the_force_of_each_axis_is_a_positive_number(complaints, value, expected):
    found = complaints(edited("K_s: [1, 2, 3]", f"K_s: {value}", TEXT))
    assert found[0].split(": ", 1)[1].startswith(expected)


def test_sticking_is_for_the_position(complaints):
    text = edited("surface: position", "surface: {slope: 20}\n  stick_energy: 1", TEXT)
    (message,) = complaints(text)
    expected = "has no effect on a slope surface (expected surface: position)"
    assert message.endswith(f"controller.stick_energy: {expected}")


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


def test_a_misspelt_law_is_the_one_that_it_resembles(complaints):
    found = complaints(edited("  K_t:", "  law: {implict: 1.0e-3}\n  K_t:", TEXT))
    assert any(
        "controller.law.implict: is unknown (did you mean implicit?)" in line for line in found
    )
    assert not any("boundary_layer" in line for line in found)


@pytest.mark.parametrize(
    "line", ["surface: {slope: 20}", "law: {implicit: 1.0e-3}", "law: {boundary_layer: 1.0e-3}"]
)
def test_no_sticking_may_be_written_with_every_surface_and_law(load, line):
    """Zero is the default, so a resolved config contains it."""
    text = TEXT if line.startswith("law") else edited("  surface: position\n", "", TEXT)
    config = load(edited("  K_t:", f"  {line}\n  stick_energy: 0\n  K_t:", text))
    assert config.controller.stick_energy == 0.0
