"""Protects members as single runs: each equals the run of its config, and fails alone."""

from pathlib import Path

import numpy as np
import pytest

from rbstab.config.build import problem_of
from rbstab.experiment.simulate import simulate
from rbstab.experiment.summary import summary_of
from rbstab.integrate.engines import EngineMissingError
from rbstab.integrate.status import RunStatus
from rbstab.sweep.members import engines, single
from rbstab.sweep.members.engine import columns_of_failed
from rbstab.sweep.members.engines import factory_for, fastest_engine
from rbstab.sweep.members.ensemble import ensemble_engine
from rbstab.sweep.members.outcome import COLUMNS, STATUSES
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.plan.load import load_plan

VARIANTS = Path(__file__).parents[3] / "configs" / "sweeps" / "variants.yaml"

SHORT = ("integration.engine=heyoka", "integration.duration=0.3", "integration.samples=41")

MANY_SAMPLES = (*SHORT[:2], "integration.samples=1281")


@pytest.mark.parametrize("member", [1, 1500, 2001, 3999, 4001])
def test_a_member_is_its_single_run(member):
    plan = load_plan(VARIANTS, SHORT)
    found = {name: v[1] for name, v in SingleRuns(plan).compute(member - 1, member + 1)[0].items()}
    run = simulate(plan.config_of(member))
    assert found["run_id"].decode() == run.run_id
    assert STATUSES[found["status"]] == run.status
    assert found["steps"] == run.attributes["steps"]
    for name in ("orientation", "angular_velocity", "position", "velocity"):
        assert (found[f"final_{name}"] == run[name][-1]).all()
    own = run["connector_state"][-1] if "connector_state" in run else np.full(3, np.nan)
    assert np.array_equal(found["final_connector_state"], own, equal_nan=True)
    summary = summary_of(run)
    assert (found["lyapunov_start"], found["lyapunov_end"]) == summary[:2]
    # The summary of a run has the peaks of cubics, so it needs more samples.
    fine = summary_of(simulate(load_plan(VARIANTS, MANY_SAMPLES).config_of(member)))
    peaks = fine.peak_contact_displacement
    assert found["peak_contact_displacement"] == pytest.approx(peaks, rel=1e-5, abs=1e-9)
    assert found["peak_orientation"][1] == pytest.approx(fine.largest_pitch, rel=1e-5)
    assert found["peak_contact_displacement_error"] <= 1e-5 * np.abs(peaks).max() + 1e-9
    assert found["energy_residual"] == np.abs(run["energy_residual"]).max()


def make_member_fail(member, plan, monkeypatch):
    """Make the preparation of a member raise an error."""
    title = plan.config_of(member).title

    def failing(config):
        if config.title == title:
            raise ZeroDivisionError
        return problem_of(config)

    monkeypatch.setattr(single, "problem_of", failing)


def test_a_member_that_cannot_be_followed_fails_alone(load, monkeypatch):
    plan = load(
        "base: free.yaml\nvary:\n  body.mass: {linspace: [40, 50, 4]}\n",
        "integration.duration=0.02",
        "integration.samples=3",
    )
    before = SingleRuns(plan).compute(0, 4).outcome
    make_member_fail(2, plan, monkeypatch)
    after = SingleRuns(plan).compute(0, 4).outcome
    others = [0, 1, 3]
    for name, column in COLUMNS.items():
        assert before[name].dtype == after[name].dtype == column.dtype
        assert before[name][others].tobytes() == after[name][others].tobytes()
        if column.dtype == "f8":
            assert np.isnan(after[name][2]).all()
    assert STATUSES[after["status"][2]] is RunStatus.SOLVER_FAILURE
    assert (after["run_id"] == before["run_id"]).all()


def test_ends_are_kept(load):
    plan = load(
        """\
base: visco-elastic.yaml
vary:
  initial.angular_velocity[1]: {values: [1, 1e150, 40]}
""",
        "integration.step_limit=3",
        "initial.angular_velocity=[0,0,0]",
        "integration.rtol=1e-6",
        "integration.duration=0.1",
    )
    found = SingleRuns(plan).compute(0, 3).outcome
    ends = [STATUSES[code] for code in found["status"]]
    assert ends == [simulate(plan.config_of(index)).status for index in range(3)]
    assert RunStatus.STEP_LIMIT in ends
    assert RunStatus.COMPLETED not in ends
    assert found["end_time"][0] > 0


def test_members_without_result():
    found = columns_of_failed(3)
    assert list(found) == list(COLUMNS)
    assert {len(values) for values in found.values()} == {3}
    assert {STATUSES[code] for code in found["status"]} == {RunStatus.SOLVER_FAILURE}


def test_which_engine_is_taken(monkeypatch):
    assert fastest_engine() in ("heyoka", "scipy")
    assert factory_for("scipy") is SingleRuns
    assert factory_for("heyoka") is ensemble_engine

    def missing(name):
        raise EngineMissingError(name)

    monkeypatch.setattr(engines, "engine", missing)
    assert fastest_engine() == "scipy"
    with pytest.raises(EngineMissingError):
        factory_for("heyoka")


@pytest.mark.parametrize(
    "surface", ["{slope: 20}", pytest.param("position", marks=pytest.mark.slow)]
)
def test_a_motion_that_slides_settles_when_its_own_energy_does(surface):
    example = "configs/examples/sliding/slope_exact_20000.yaml"
    plan = load_plan(
        {
            "base": example,
            "vary": {"initial.angular_velocity[2]": {"values": [-16, -15]}},
        },
        ["integration.engine=heyoka", f"controller.surface={surface}", "integration.samples=201"],
    )
    run = simulate(plan.config_of(0))
    # On s = F + κE the work ε of the contact force replaces the energy of the connector.
    held = np.array([part != "connector" or surface == "position" for part in run["part"]])
    v = run["energy"][:, held].sum(axis=1) - run["energy_at_rest"]
    assert (run["lyapunov"][-1] < 1e-3 * v[0]) == (surface == "position")
    settled = SingleRuns(plan).compute(0, 1).outcome["settling_time"][0]
    after = run["time"] > settled
    assert (v[after] < 1e-3 * v[0]).all()
    assert v[~after][-1] >= 1e-3 * v[0]
    assert np.diff(run["time"])[0] > settled - run["time"][~after][-1] >= 0
