"""Protects the warnings about configs that are valid and most likely not meant: each names the
likely unit, and none is given for a config of this project.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.configs import SLIDING, VISCO_ELASTIC, edited, plain
from support.leg import BODY

from rbstab.config.load import config_to_read, load_config
from rbstab.config.warnings import config_warnings
from rbstab.sweep.plan.load import is_plan, plan_to_read

CONFIGS = Path(__file__).parents[3] / "configs"

LEG: dict[str, Any] = {
    "schema_version": 2,
    "body": BODY,
    "gravity": [0, 0, -9.81],
    "elements": {
        "medial": {
            "kind": "ligament",
            "point": [0.0, -0.03, -0.13],
            "anchor": [0, -0.04, -0.21],
            "stiffness": 3000,
            "slack_length": 0.082,
            "toe_strain": 0.03,
        },
        "hum": {
            "kind": "input",
            "quantity": "force",
            "point": [0, 0, 0],
            "direction": [1, 0, 0],
            "amplitude": 1,
            "signal": {"kind": "sine", "frequency": 2, "phase": 1},
        },
    },
    "initial": {"orientation": [0.1, 0.2, 0], "angular_velocity": [0, 2, 0]},
    "integration": {"duration": 5},
}
"""A leg: its radius of gyration is √(0.059/3.5) = 0.13 m."""

FIRES = [
    (["body.contact_point=[0,0,-186]"], "body.contact_point: up to 186 m", "in m (not mm)?"),
    (["elements.medial.slack_length=58"], "elements.medial.slack_length: up to 58 m", "not mm"),
    (["elements.medial.anchor=[0,-40,-210]"], "elements.medial.anchor: up to 213.8 m", "not mm"),
    (["elements.medial.point=[0,-30,-130]"], "elements.medial.point: up to 133.4 m", "not mm"),
    (["initial.position=[0,0,250]"], "initial.position: up to 250 m", "not mm"),
    (["elements.medial.toe_strain=3"], "elements.medial.toe_strain: 3 is 300 %", "3 % is 0.03"),
    (["body.mass=3500"], "body.mass: a ball with this mass and inertia", "in kg (not g)"),
    (["body.inertia=[59,59,6]"], "body.inertia: a ball with this", "in kg m² (not g m²)"),
    (["body.inertia=[59e3,59e3,6e3]"], "body.inertia: a ball with this", "(not kg mm²)"),
    (["body.inertia=[59e6,59e6,6e6]"], "body.inertia: a ball with this", "(not g mm²)"),
    (["body.inertia=[59e-6,59e-6,6e-6]"], "body.mass: a ball with", "the inertia in kg m²?"),
    (["gravity=[0,0,-9810]"], "gravity: 9810 m/s²", "in m/s² (not mm/s²)?"),
    (["gravity=[0,0,9.81]"], "gravity: it points up", "down is [0, 0, -9.81]"),
    (["desired.within=3"], "desired.within: 3 rad is 171.9°", "in degrees: {deg: 3}"),
    (["initial.angular_velocity=[0,0,200]"], "initial.angular_velocity: 200 rad/s is 31.8", "deg:"),
    (["elements.hum.signal.phase=90"], "elements.hum.signal.phase: 90 rad is 14.3", "{deg: 90}"),
]


def warnings_of(changes):
    return config_warnings(load_config(LEG, changes))


@pytest.mark.parametrize(("changes", "begin", "part"), FIRES)
def test_a_likely_wrong_unit_is_named(changes, begin, part):
    warnings = warnings_of(changes)
    assert [line.startswith(begin) and part in line for line in warnings] == [True], warnings


@pytest.mark.parametrize(
    "changes",
    [
        [],
        ["desired.within={deg: 90}"],
        ["desired.within=0.2"],
        ["initial.angular_velocity={deg: [0, 0, 11459]}"],
        ["elements.hum.signal.phase={deg: 900}"],
        ["initial.angular_velocity=[0,0,160]"],
        ["gravity=[0,0,0]"],
        ["gravity=[9.81,0,0]"],
        ["body.contact_point=[0,0,0]"],
        ["body.mass=35", "body.inertia=[0.59,0.59,0.06]"],
    ],
)
def test_what_may_be_meant_has_no_warning(changes):
    assert warnings_of(changes) == []


def test_the_triangle_is_judged_by_principal_moments():
    """The matrix is diag(10, 8, 0.4) in turned axes, so its diagonal does not show the moments."""
    turn = Rotation.from_euler("zx", [0.7, 0.7]).as_matrix()
    matrix = turn @ np.diag([10, 8, 0.4]) @ turn.T
    data = plain(VISCO_ELASTIC)
    data["body"]["inertia"] = (0.5 * (matrix + matrix.T)).tolist()
    (warning,) = config_warnings(load_config(data))
    assert "10 > 8 + 0.4" in warning


@pytest.mark.parametrize(("stiffness", "warned"), [(1e-6, True), (40.0, True), (50.0, False)])
def test_an_anchor_far_from_the_origin_has_a_warning(stiffness, warned):
    """The body sags by 410 N/K_t."""
    changes = ["gravity=[0,0,-10]", "body.inertia=[1,1,1]", f"controller.K_t={[stiffness] * 3}"]
    assert config_warnings(load_config(plain(), changes)) == []
    changes.append("controller.anchor=equilibrium")
    # So far away, the connector pulls with a force that makes the motion fast as well.
    warnings = config_warnings(load_config(plain(), changes))
    assert sum(line.startswith("controller.anchor") for line in warnings) == warned


@pytest.mark.parametrize(("h", "warned"), [(0.02, True), (0.01, False)])
def test_a_step_longer_than_the_samples_are_apart_has_a_warning(h, warned):
    text = edited("position", f"position\n  law: {{implicit: {h}}}", SLIDING)
    config = load_config(plain(text), ["integration.duration=1", "integration.samples=101"])
    assert any("steps of 0.01 s are used" in line for line in config_warnings(config)) == warned


def shipped(path):
    if is_plan(path):
        return list(plan_to_read(path).bases.values())
    return [config_to_read(path)]


@pytest.mark.slow
@pytest.mark.parametrize("folder", sorted(path.name for path in CONFIGS.iterdir()))
def test_no_config_of_the_project_has_a_likely_wrong_unit(folder):
    """The body of the paper breaks the triangle inequality, and implicit steps damp numerically."""
    files = sorted((CONFIGS / folder).rglob("*.yaml"))
    warnings = {
        warning
        for path in files
        for config in shipped(path)
        for warning in config_warnings(config)
        if "triangle inequality" not in warning and not warning.startswith("controller.law")
    }
    assert files
    assert warnings == set()
