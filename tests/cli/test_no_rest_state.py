"""Protects what is said of a body that cannot rest in the range of eq. 5."""

import json
from pathlib import Path

import pytest
from cli.conftest import Invoke

import rbstab

# Its weight turns it over its side: θ2 passes π/2 on the way down.
CONFIG = """\
body: {mass: 41, inertia: [10, 9, 2], contact_point: [-0.0184, 0.0349, -0.0505]}
gravity: [-22.8, -224, 10.4]
controller:
  variant: visco-elastic
  K_r: [12.6, 0.11, 31.5]
  L_r: [60, 60, 42]
  K_t: [0.336, 4169, 1.19]
  L_t: [200, 200, 140]
  K_c: [1.04, 3.0, 3.47]
  L_c: [20, 20, 20]
initial: {angular_velocity: [0.1, 0.2, -0.1]}
integration: {duration: 0.01, samples: 3}
"""


@pytest.fixture
def config(folder: Path) -> str:
    (folder / "falls.yaml").write_text(CONFIG)
    return "falls.yaml"


def test_global_stability_is_false(config: str, rbstab: Invoke) -> None:
    done = rbstab("stability", config, "--json")
    assert done.exit_code == 0
    (facts,) = json.loads(done.stdout)
    assert facts["proved"] is True
    assert facts["states"] == []
    assert facts["statements"][:3] == [
        f"Rest states: no rest state in the range; proved ({facts['examined']} boxes).",
        "Globally stable: false; no motion that stays in the range comes to rest.",
        "Certified region: none.",
    ]
    assert all(text.startswith("For all real θ1 and θ3") for text in facts["statements"][3:])
    lines = {line["check"]: line for line in facts["certificate"]["lines"]}
    assert lines["global stability"]["verdict"] == "violated"
    assert lines["global stability"]["value"] == 0
    assert lines["certified region"]["verdict"] == "unknown"
    assert facts["certificate"]["verdict"] != "certified"


def test_a_run_says_so_too(config: str, rbstab: Invoke) -> None:
    assert rbstab("run", config, "--prove").exit_code == 0
    result = rbstab_result("results/falls.h5")
    verdicts = dict(zip(result["certificate/check"], result["certificate/verdict"], strict=True))
    assert verdicts["global stability"] == "violated"
    told = "no rest state was found in the range of eq. 5"
    assert told in str(result.attributes["warnings"]).splitlines()
    assert result.attributes["lyapunov_zero"] == told


def rbstab_result(path: str) -> rbstab.Result:
    """Return a stored result; the fixture hides the package of the same name."""
    return rbstab.open_result(path)
