"""`rbstab tune`, `sensitivities` and `guard`: what they write is better, or proved."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cli.conftest import GOOD, ended, json_of, rbstab, success
from support.paper_runs import paper_config

from rbstab.config.files.dump import as_yaml
from rbstab.config.load import load_config
from rbstab.experiment.proof import prove
from rbstab.experiment.simulate import simulate
from rbstab.experiment.tuning.guard import with_barrier

GAINS = ("--over", "controller.L_r,controller.L_t")

OVER = (*GAINS, "--bounds", "0.5:2")


def test_a_better_config_is_written_and_not_overwritten(folder):
    arguments = ("tune", "good.yaml", "--objective", "energy", *OVER)
    done = success(*arguments)
    assert "controller.L_t[2]" in done.stdout
    assert "energy ∫v dt [J s]" in done.stdout
    assert done.stderr.endswith("good.yaml: found a better config -> good_tuned.yaml\n")
    assert load_config("good_tuned.yaml").title == "A short run, tuned for energy"
    (row,) = [line for line in done.stdout.splitlines() if "controller.L_t[2]" in line]
    given, tuned, factor = map(float, row.split()[-3:])
    assert given == load_config("good.yaml").controller.L_t[2]
    assert tuned == pytest.approx(load_config("good_tuned.yaml").controller.L_t[2], rel=1e-5)
    assert tuned == pytest.approx(given * factor, rel=1e-3)
    text = Path("good_tuned.yaml").read_text()
    again = ended(4, *arguments)
    assert again.stderr == "good_tuned.yaml: already exists. Replace it with --force.\n"
    Path("good_tuned.yaml").write_text("old")
    success(*arguments, "--force")
    assert Path("good_tuned.yaml").read_text() == text
    assert Path("good.yaml").read_text() == GOOD


def test_the_factors_are_those_of_the_written_config(folder):
    done = rbstab("tune", "good.yaml", "--objective", "energy", *OVER, "-o", "t.yaml", "--json")
    facts = json.loads(done.stdout)
    assert facts["file"] == "t.yaml"
    assert facts["better"] is True
    assert facts["tuned"] < facts["given"]
    factor = facts["factors"]["controller.L_r"]
    assert load_config("t.yaml").controller.L_r[0] == 60 * factor


def test_nothing_better_writes_nothing(folder):
    arguments = ("--objective", "energy", "--over", "controller.L_r", "--bounds", "1:1")
    done = success("tune", "good.yaml", *arguments)
    assert done.stderr.endswith("good.yaml: no better config was found; nothing is written\n")
    assert not Path("good_tuned.yaml").exists()


def test_no_run_that_settles_is_exit_code_3(folder):
    done = ended(3, "tune", "good.yaml", "--objective", "settling_time", *OVER)
    assert done.stderr.endswith("no run completed and settled; nothing is written\n")
    (row,) = [line for line in done.stdout.splitlines() if "settling_time" in line]
    assert row.split()[3:] == [*["not", "in", "this", "run"] * 2, "-"]
    assert not Path("good_tuned.yaml").exists()


STICKING = GOOD.replace(
    "variant: free",
    "variant: sliding\n  K_s: [9, 9, 9]\n  surface: position\n  stick_energy: 0.5",
)


@pytest.fixture
def settling_config(folder):
    """The working folder, where `good.yaml` runs until it has settled."""
    text = GOOD.replace("duration: 0.1", "duration: 2")
    Path("good.yaml").write_text(text)
    return folder


def test_the_tables_name_every_parameter(settling_config):
    done = success("sensitivities", "good.yaml")
    quantities, relative, per_unit = done.stdout.strip().split("\n\n")
    assert "settling_time [s]" in quantities
    assert "peak_contact_displacement[2] [m]" in quantities
    for text in (relative, per_unit):
        assert len(text.splitlines()) == 1 + 12 + 7 + 12
        assert "controller.L_r[1]" in text
        assert "body.contact_point[2]" in text
        assert "initial.velocity[0]" in text
    assert not Path("results").exists()


def test_the_json_holds_all(settling_config):
    facts = json_of("sensitivities", "good.yaml")
    names = [quantity["name"] for quantity in facts["quantities"]]
    assert names[0] == "settling_time"
    assert {"peak_time[0]", "final.orientation[0]", "final.velocity[2]"} <= set(names)
    by_key = {parameter["key"]: parameter for parameter in facts["parameters"]}
    mass = by_key["body.mass"]
    settling_time = facts["quantities"][0]["value"]
    expected = 41.0 / settling_time * mass["derivatives"]["settling_time"]
    assert mass["value"] == 41.0
    assert mass["relative"]["settling_time"] == pytest.approx(expected)


def test_a_run_that_does_not_complete_is_said(folder):
    done = ended(3, "sensitivities", "good.yaml", "--set", "integration.step_limit=1")
    assert done.stderr.startswith("error: step limit: stopped after 1 steps")


SHORT: dict[str, Any] = {"duration": 0.2, "samples": 21, "rtol": 1e-8}
STRUT = {
    "kind": "spring",
    "point": [0.0, 0.0, 0.1],
    "anchor": [0.0, 0.0, 0.5],
    "stiffness": 100.0,
    "rest_length": 0.3,
}


def with_elements(**elements):
    return {**paper_config("permanent", **SHORT), "schema_version": 2, "elements": elements}


@pytest.fixture
def case1(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "case1.yaml"
    path.write_text(as_yaml(paper_config("permanent", **SHORT)))
    return path


def test_the_config_that_it_writes_is_proved(case1):
    done = success("guard", "case1.yaml")
    end = "every start in the range converges: proved -> case1_guarded.yaml\n"
    assert done.stderr.endswith(end)
    written = load_config("case1_guarded.yaml")
    element = written.elements["range"]
    assert (element.kind, element.method) == ("guard", "barrier")
    assert prove(written).every_start
    # Apart from the barrier it is the given config.
    assert with_barrier(load_config(case1), element.stiffness) == written
    again = ended(4, "guard", "case1.yaml")
    assert again.stderr == "case1_guarded.yaml: already exists. Replace it with --force.\n"
    success("guard", "case1.yaml", "--force")


@pytest.mark.slow
def test_the_couple_of_the_barrier_is_that_of_its_potential(case1):
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


@pytest.mark.slow
@pytest.mark.parametrize(("method", "key"), [("stiff", "stiffness"), ("repelling", "couple")])
def test_a_soft_guard_keeps_this_start_in_the_range(case1, method, key):
    options = ("--method", method, "--soft-angle", "1.1", "--limit", "50000", "--json")
    done = success("guard", "case1.yaml", *options)
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


def test_a_couple_above_the_limit_is_not_written(case1):
    done = ended(3, "guard", "case1.yaml", "--method", "repelling", "--limit", "20000", "--json")
    assert done.stderr.endswith(
        "the couple exceeds the limit of 20000 N m in the run; nothing is written\n"
    )
    facts = json.loads(done.stdout)
    assert (facts["file"], facts["below_limit"]) == (None, False)
    assert not Path("case1_guarded.yaml").exists()


def test_no_soft_guard_says_why(case1):
    case1.write_text(as_yaml(with_elements(strut=STRUT)))
    done = ended(3, "guard", "case1.yaml", "--method", "stiff", "--json")
    why = "no guard was found: the least soft guard is not looked for beside springs"
    assert why in done.stderr
    assert json.loads(done.stdout)["proved"] is None


def test_rest_states_at_other_angles_are_why_no_barrier_is_found(case1, monkeypatch):
    """A shank hangs from its knee by soft springs: it can also rest after a whole turn."""
    monkeypatch.setattr("rbstab.experiment.tuning.guard.LADDER", (0.01, 1.0))
    data = with_elements()
    data["body"] = {"mass": 4.6, "inertia": [0.056, 0.058, 0.006], "contact_point": [0, 0, 0.25]}
    data["gravity"] = [0, 0, -9.81]
    gains = {"K_t": [1e-6] * 3, "L_t": [1e-6] * 3, "K_r": [2, 2, 5], "L_r": [0.2] * 3}
    data["controller"] = {"variant": "permanent", **gains}
    data["initial"] = {"orientation": [0.2, -1.2, 0]}
    case1.write_text(as_yaml(data))
    done = ended(3, "guard", "case1.yaml", "--json")
    facts = json.loads(done.stdout)
    assert (facts["file"], facts["stiffness"], facts["guarded"]) == (None, None, None)
    assert not Path("case1_guarded.yaml").exists()
    assert (
        "k = 1 N m: 9 rest states with |θ2| < π/2 and any θ1, θ3: 3 stable, 6 unstable\n"
        in done.stderr
    )
    assert "only if there is no other with |θ2| < π/2 and any θ1, θ3" in done.stderr
    assert done.stderr.endswith("For this start alone: --method stiff; nothing is written\n")
    soft = rbstab("guard", "case1.yaml", "--method", "stiff")
    assert "keeps the range without a guard: proved" in soft.stderr


def test_a_guard_of_the_config_is_replaced_and_other_elements_keep_their_names():
    given = load_config(with_elements(range=STRUT, range_2=STRUT))
    elements = with_barrier(with_barrier(given, 7.0), 3.0).elements
    assert [name for name, element in elements.items() if element.kind == "spring"] == [
        "range",
        "range_2",
    ]
    assert {name for name in elements if name not in given.elements} == {"range_3"}
    assert elements["range_3"].stiffness == 3.0
