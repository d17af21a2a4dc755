"""Protects `rbstab sensitivities`: its tables, its JSON, and its refusals."""

import json
from pathlib import Path

import pytest
from cli.conftest import GOOD, Invoke

STICKING = GOOD.replace(
    "variant: free",
    "variant: sliding\n  K_s: [9, 9, 9]\n  surface: position\n  stick_energy: 0.5",
)


@pytest.fixture
def settling_config(folder: Path) -> Path:
    """The working folder, where `good.yaml` runs until it has settled."""
    text = GOOD.replace("duration: 0.1", "duration: 2")
    Path("good.yaml").write_text(text)
    return folder


def test_the_tables_name_every_parameter(settling_config: Path, rbstab: Invoke) -> None:
    done = rbstab("sensitivities", "good.yaml")
    assert done.exit_code == 0
    quantities, relative, per_unit = done.stdout.strip().split("\n\n")
    assert "settling_time [s]" in quantities
    assert "peak_contact_displacement[2] [m]" in quantities
    for text in (relative, per_unit):
        assert len(text.splitlines()) == 1 + 12 + 7 + 12
        assert "controller.L_r[1]" in text
        assert "body.contact_point[2]" in text
        assert "initial.velocity[0]" in text
    assert not Path("results").exists()


def test_the_json_holds_all(settling_config: Path, rbstab: Invoke) -> None:
    facts = json.loads(rbstab("sensitivities", "good.yaml", "--json").stdout)
    names = [quantity["name"] for quantity in facts["quantities"]]
    assert names[0] == "settling_time"
    assert {"peak_time[0]", "final.orientation[0]", "final.velocity[2]"} <= set(names)
    by_key = {parameter["key"]: parameter for parameter in facts["parameters"]}
    mass = by_key["body.mass"]
    settling_time = facts["quantities"][0]["value"]
    expected = 41.0 / settling_time * mass["derivatives"]["settling_time"]
    assert mass["value"] == 41.0
    assert mass["relative"]["settling_time"] == pytest.approx(expected)


def test_a_run_that_does_not_complete_is_said(folder: Path, rbstab: Invoke) -> None:
    done = rbstab("sensitivities", "good.yaml", "--set", "integration.step_limit=1")
    assert done.exit_code == 3
    assert done.stderr.startswith("good.yaml: step limit: stopped after 1 steps")
