"""`coordinates: quaternion` is refused where an element reads Euler angles."""

import copy
from typing import Any

import pytest
from support.configs import PERMANENT, VISCO_ELASTIC, messages_of, plain

from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config, resolved, run_id
from rbstab.sweep.plan.load import load_plan

READS = "expected other coordinates, or elements that do not: no K_r, guards or Python"
STOP = {"kind": "guard", "method": "stop", "angle": 1.2, "restitution": 0.5}
BARRIER = {"kind": "guard", "method": "barrier", "stiffness": 1.0}


def config(text=VISCO_ELASTIC, elements=None, **controller) -> dict[str, Any]:
    data = copy.deepcopy(plain(text)) | {"schema_version": 2}
    data["controller"] |= {"K_r": [0, 0, 0]} | controller
    data["elements"] = elements or {}
    data["integration"]["coordinates"] = "quaternion"
    return data


def problems_of(data):
    with pytest.raises(ConfigError) as error:
        load_config(data)
    return str(error.value).splitlines()


@pytest.mark.parametrize(
    ("data", "what"),
    [
        (config(K_r=[0, 0, 1e-6]), "controller.K_r"),
        (config(K_r=[[0, 0, 0], [0, 1, 0], [0, 0, 0]]), "controller.K_r"),
        (config(elements={"stop": STOP}), "stop"),
        (config(elements={"rim": BARRIER}, K_r=[1, 1, 1]), "controller.K_r, rim"),
        (config(PERMANENT, K_r=[1, 1, 1]), "controller.K_r"),
    ],
)
def test_what_reads_angles_is_refused(data, what):
    (found,) = problems_of(data)
    assert found.endswith(
        f"integration: has coordinates: quaternion, but {what} may read Euler angles ({READS})"
    )


def test_the_place_is_told(tmp_path):
    path = tmp_path / "spun.yaml"
    path.write_text(VISCO_ELASTIC + "  coordinates: quaternion\n")
    (found,) = messages_of(load_config, path, [])
    assert found.startswith(f"{path}:18:3: integration: has coordinates: quaternion")
    assert "controller.K_r may read Euler angles" in found


def test_a_sweep_of_what_reads_angles_is_refused():
    vary = {"controller.K_r[0]": {"linspace": [0, 1, 3]}}
    with pytest.raises(ConfigError, match="K_r may read Euler angles"):
        load_plan({"base": config(), "vary": vary})


def test_a_sliding_connector_keeps_its_coordinates():
    data = config() | {"controller": {"variant": "sliding"}}
    found = problems_of(data)
    assert any("integration.coordinates: is the text 'quaternion' (expected W" in p for p in found)


def test_a_start_at_the_pole_is_one_as_any_other():
    data = config()
    data["initial"]["orientation"] = [0.1, 1.5707963267948, 0.2]
    load_config(data)
    data["integration"]["coordinates"] = "Z"
    (found,) = problems_of(data)
    assert "cos θ2" in found


def test_it_is_part_of_the_identity_and_drift_control_is_not():
    data = config(PERMANENT)
    quaternion = load_config(data)
    assert resolved(quaternion)["integration"]["coordinates"] == "quaternion"
    assert "drift_control" not in resolved(quaternion)["integration"]
    data["integration"]["coordinates"] = "reduced"
    assert run_id(load_config(data)) != run_id(quaternion)
