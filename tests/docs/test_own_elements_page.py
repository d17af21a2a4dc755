"""Protects docs/own_elements.md: its element is the template, its outputs are real, names exist."""

import re

import pytest
from support.documents import ROOT, blocks_of, page

import rbstab.elements
from rbstab.config.load import load_config
from rbstab.elements.user_code.loaded import UserCode, element_class
from rbstab.elements.user_code.template import TEMPLATE
from rbstab.experiment.element_check.check import check_class
from rbstab.sweep.plan.load import load_plan

PAGE = page("own_elements")
EXAMPLE = ROOT / "configs" / "examples" / "cubic_spring.py"

PYTHON = blocks_of(PAGE, "python")


def test_the_element_of_the_page_is_the_template_and_the_example():
    assert PYTHON[0] == TEMPLATE
    assert EXAMPLE.read_text(encoding="utf-8") == TEMPLATE


def test_twenty_lines_suffice():
    lines = [line.strip() for line in TEMPLATE.splitlines()]
    assert len([line for line in lines if line and not line.startswith("#")]) <= 20
    assert "in twenty lines" in PAGE or "of twenty lines" in PAGE


def test_the_wrong_statement_of_the_page():
    code = UserCode(TEMPLATE.replace("0.25", "0.5"), "cubic_spring.py")
    (problem,) = check_class(element_class(code, "CubicSpring"), code).problems
    shown = " ".join(PAGE.split("  WRONG  ")[1].split("Θ = ...")[0].split())
    assert " ".join(problem.split()).startswith(shown)


def test_the_rope():
    pytest.importorskip("heyoka")
    code = UserCode(PYTHON[2], "rope.py")
    checked = check_class(element_class(code, "Rope"), code)
    assert checked.problems == ()
    assert "`stored` is continuous at each switch" in checked.passed


def test_the_element_with_an_own_state():
    pytest.importorskip("heyoka")
    code = UserCode(PYTHON[3], "maxwell.py")
    assert check_class(element_class(code, "Maxwell"), code).problems == ()
    lines = [line for line in PYTHON[3].splitlines() if line.strip()]
    assert len(lines) <= 25


def test_every_name_of_the_module_is_on_the_page():
    for name in rbstab.elements.__all__:
        assert hasattr(rbstab.elements, name)
        assert re.search(rf"`[^`\n]*\b{name}\b[^`\n]*`", PAGE), name
    for function in ("force_at_centre(f)", "force_at(motion, p, f)", "power(x, n)", "cross(a, b)"):
        assert f"`{function}`" in PAGE


def test_the_configs_of_the_page():
    config = load_config(EXAMPLE.with_suffix(".yaml"), allow_python=True)
    assert config.elements["mine"].class_name == "CubicSpring"
    load_plan(ROOT / "configs" / "sweeps" / "cubic_spring.yaml", allow_python=True)
    (yaml,) = blocks_of(PAGE, "yaml")
    assert yaml in EXAMPLE.with_suffix(".yaml").read_text(encoding="utf-8")


def test_every_command_that_needs_the_option_is_named():
    from rbstab_cli.registry import COMMANDS, Registry

    group = Registry()
    security = PAGE.split("## Security")[1]
    for name in COMMANDS:
        command = group.get_command(None, name)  # type: ignore[arg-type]
        assert command is not None
        if any("--allow-python" in parameter.opts for parameter in command.params):
            assert f"`{name}`" in security, name
