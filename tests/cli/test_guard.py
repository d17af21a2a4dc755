"""Protects `rbstab guard`: what it writes is proved, and what cannot be proved is not written."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cli.conftest import Invoke
from support.paper_runs import paper_config

from rbstab.config.files.dump import as_yaml
from rbstab.config.load import load_config
from rbstab.experiment.proof import prove
from rbstab.experiment.simulate import simulate
from rbstab.experiment.tuning.guard import with_barrier

SHORT: dict[str, Any] = {"duration": 0.2, "samples": 21, "rtol": 1e-8}
STRUT = {
    "kind": "spring",
    "point": [0.0, 0.0, 0.1],
    "anchor": [0.0, 0.0, 0.5],
    "stiffness": 100.0,
    "rest_length": 0.3,
}


def with_elements(**elements: Any) -> dict[str, Any]:
    return {**paper_config("permanent", **SHORT), "schema_version": 2, "elements": elements}


@pytest.fixture
def case1(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "case1.yaml"
    path.write_text(as_yaml(paper_config("permanent", **SHORT)))
    return path


def test_the_config_that_it_writes_is_proved(case1: Path, rbstab: Invoke) -> None:
    done = rbstab("guard", "case1.yaml")
    assert done.exit_code == 0
    end = "every start in the range converges: proved -> case1_guarded.yaml\n"
    assert done.stderr.endswith(end)
    written = load_config("case1_guarded.yaml")
    element = written.elements["range"]
    assert (element.kind, element.method) == ("guard", "barrier")
    assert prove(written).every_start
    # Apart from the barrier it is the given config.
    assert with_barrier(load_config(case1), element.stiffness) == written
    again = rbstab("guard", "case1.yaml")
    assert again.exit_code == 4
    assert again.stderr == "case1_guarded.yaml: already exists. Replace it with --force.\n"
    assert rbstab("guard", "case1.yaml", "--force").exit_code == 0


def test_json(case1: Path, rbstab: Invoke) -> None:
    done = rbstab("guard", "case1.yaml", "-o", "g.yaml", "--json")
    facts = json.loads(done.stdout)
    assert facts["file"] == "g.yaml"
    assert facts["stiffness"] == facts["tried"][-1]["stiffness"]
    assert facts["given"]["largest_couple"] == 0
    fine = load_config("g.yaml", ["integration.samples=4001"])
    Theta = simulate(fine)["orientation"][:, 1]
    # The couple of ½ k tan² θ2 about the axis of θ2, which is a unit vector of the body.
    couple = facts["stiffness"] * np.abs(np.tan(Theta) / np.cos(Theta) ** 2).max()
    assert facts["guarded"]["largest_couple"] == pytest.approx(couple, rel=1e-3)
    assert facts["guarded"]["largest_pitch"] == pytest.approx(np.abs(Theta).max(), rel=1e-3)


@pytest.mark.parametrize(("method", "key"), [("stiff", "stiffness"), ("repelling", "couple")])
def test_a_soft_guard_for_this_start(case1: Path, rbstab: Invoke, method: str, key: str) -> None:
    options = ("--method", method, "--soft-angle", "1.1", "--limit", "50000", "--json")
    done = rbstab("guard", "case1.yaml", *options)
    assert done.exit_code == 0
    assert done.stderr.endswith(
        "case1.yaml: this start keeps the range: proved -> case1_guarded.yaml\n"
        "case1.yaml: convergence to the rest state at Θ = (0, 0, 0) rad: proved\n"
    )
    facts = json.loads(done.stdout)
    element = load_config("case1_guarded.yaml").elements["range"]
    assert (element.kind, element.method, element.soft_angle) == ("guard", method, 1.1)
    assert facts[key] == getattr(element, key)
    proved = facts["proved"]
    assert proved["energy"] < proved["energy_bound"]
    assert proved["converges"]
    assert facts["below_limit"] is True
    assert facts["guarded"]["largest_couple"] <= proved["couple_bound"]


def test_a_couple_above_the_limit_is_not_written(case1: Path, rbstab: Invoke) -> None:
    done = rbstab("guard", "case1.yaml", "--method", "repelling", "--limit", "20000", "--json")
    assert done.exit_code == 3
    assert done.stderr.endswith(
        "the couple exceeds the limit of 20000 N m in the run; nothing is written\n"
    )
    facts = json.loads(done.stdout)
    assert (facts["file"], facts["below_limit"]) == (None, False)
    assert not Path("case1_guarded.yaml").exists()


def test_a_start_that_needs_no_soft_guard(case1: Path, rbstab: Invoke) -> None:
    slow = ("--set", "initial.angular_velocity=[1, 2, 3]")
    done = rbstab("guard", "case1.yaml", "--method", "stiff", *slow)
    assert done.exit_code == 0
    assert "keeps the range without a guard: proved; nothing is written\n" in done.stderr
    assert not Path("case1_guarded.yaml").exists()


def test_no_soft_guard_says_why(case1: Path, rbstab: Invoke) -> None:
    case1.write_text(as_yaml(with_elements(strut=STRUT)))
    done = rbstab("guard", "case1.yaml", "--method", "stiff", "--json")
    assert done.exit_code == 3
    why = "no guard was found: the least soft guard is not looked for beside springs"
    assert why in done.stderr
    assert json.loads(done.stdout)["proved"] is None


def test_what_cannot_be_proved_is_not_written(
    case1: Path, rbstab: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    # A spring of a body that is not held may lose its length, whatever the barrier is.
    monkeypatch.setattr("rbstab.proof.limits.BRIEF_WITH_SPRINGS", 100)
    data = {**with_elements(strut=STRUT), "controller": paper_config("free")["controller"]}
    case1.write_text(as_yaml(data))
    done = rbstab("guard", "case1.yaml", "--json")
    assert done.exit_code == 3
    facts = json.loads(done.stdout)
    assert (facts["file"], facts["stiffness"], facts["guarded"]) == (None, None, None)
    # That is the same for every stiffness.
    assert len(facts["tried"]) == 1
    assert "may lose its length" in facts["tried"][0]["outcome"]
    assert not Path("case1_guarded.yaml").exists()


def test_rest_states_at_other_angles_are_why_no_barrier_is_found(
    case1: Path, rbstab: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A shank hangs from its knee by soft springs: it can also rest after a whole turn."""
    monkeypatch.setattr("rbstab.experiment.tuning.guard.LADDER", (0.01, 1.0))
    data = with_elements()
    data["body"] = {"mass": 4.6, "inertia": [0.056, 0.058, 0.006], "contact_point": [0, 0, 0.25]}
    data["gravity"] = [0, 0, -9.81]
    gains = {"K_t": [1e-6] * 3, "L_t": [1e-6] * 3, "K_r": [2, 2, 5], "L_r": [0.2] * 3}
    data["controller"] = {"variant": "permanent", **gains}
    data["initial"] = {"orientation": [0.2, -1.2, 0]}
    case1.write_text(as_yaml(data))
    done = rbstab("guard", "case1.yaml")
    assert done.exit_code == 3
    assert (
        "k = 1 N m: 9 rest states with |θ2| < π/2 and any θ1, θ3: 3 stable, 6 unstable\n"
        in done.stderr
    )
    assert "only if there is no other with |θ2| < π/2 and any θ1, θ3" in done.stderr
    assert done.stderr.endswith("For this start alone: --method stiff; nothing is written\n")
    soft = rbstab("guard", "case1.yaml", "--method", "stiff")
    assert "keeps the range without a guard: proved" in soft.stderr


def test_a_guard_of_the_config_is_replaced_and_other_elements_keep_their_names() -> None:
    given = load_config(with_elements(range=STRUT, range_2=STRUT))
    found = with_barrier(with_barrier(given, 7.0), 3.0).elements
    assert [name for name, element in found.items() if element.kind == "spring"] == [
        "range",
        "range_2",
    ]
    assert {name for name in found if name not in given.elements} == {"range_3"}
    assert found["range_3"].stiffness == 3.0
