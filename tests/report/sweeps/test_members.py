"""Protects the reading of the members of a sweep: their outcomes, columns and proofs."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from support.configs import VISCO_ELASTIC, plain
from support.made_sweeps import GRID, SPIN, code
from support.paper_runs import paper_config
from support.sections import check_sections, sweep_sections, tables, texts
from support.stored_proofs import say_proved

from rbstab.config.build import problem_of
from rbstab.experiment.proof_cache import proof_for
from rbstab.experiment.stored_proof.starts import start_level, start_state
from rbstab.report.sweeps.members import OUTCOMES, read_members
from rbstab.report.sweeps.sections import UNREADABLE
from rbstab.store.errors import NotAResultError
from rbstab.sweep.folder.sweep_table import read_sweep
from rbstab.sweep.plan.load import load_plan, plan_yaml
from rbstab.sweep.proofs.columns import CONVERGENCE


def test_ends(members):
    statuses = ["completed", "completed", "range left", "diverged", "solver failure"]

    def columns(arrays):
        return {
            "status": [code(status) for status in statuses],
            # A member that left the range after v was small has not settled.
            "settling_time": [0.5, np.nan, 0.5, np.nan, np.nan],
        }

    swept = members({"body.mass": {"linspace": [1, 2, 5]}}, columns)
    expected = ["returns", "still moving", "left the range", "failed", "failed"]
    assert [OUTCOMES[end] for end in swept.outcomes] == expected
    assert swept.outcome_counts.sum() == len(swept) == 5
    assert swept.completed.tolist() == [True, True, False, False, False]


def test_a_plan_that_cannot_be_read(made, monkeypatch):
    def of_the_future(plan):
        return plan_yaml(plan).replace("schema_version: 1", "schema_version: 99", 1)

    monkeypatch.setattr("rbstab.sweep.folder.members_file.plan_yaml", of_the_future)
    sweep = made(GRID)
    assert read_members(sweep.path).plan is None
    sections = sweep_sections(sweep)
    check_sections(sections)
    assert UNREADABLE in sections[0].blocks
    assert "sweep-1-fractions" in tables(sections)
    assert len(sections) == 3
    assert sections[-1].folded


def test_the_proved_level_is_that_of_the_kept_proof(made):
    base = paper_config("free", True, initial={"angular_velocity": [0, 0, 0]})
    vary = {f"{SPIN}[0]": {"values": [1.0, 8.0, 9.92, 9.94, 12.0]}}
    plan = load_plan({"base": base, "vary": vary})
    configs = [plan.config_of(k) for k in range(5)]

    def columns(arrays):
        return {"lyapunov_start": [start_level(problem_of(config), proof) for config in configs]}

    results = made(vary, base=base).path.parent.parent
    proof = proof_for(results, plan.base_of("free"))
    swept = read_members(made(vary, columns, base=base).path)
    inside = [start_state(problem_of(config), proof) is not None for config in configs]
    assert (swept.column("lyapunov_start") < swept.level).tolist() == inside
    assert [CONVERGENCE[k] == "proved" for k in swept.convergence] == inside
    assert set(inside) == {True, False}


@pytest.mark.parametrize("varied", [GRID, {"body.mass": {"values": [1, 2]}}])
def test_without_a_proof_the_column_speaks(members, varied):
    swept = members(varied, lambda arrays: {"convergence": arrays["run"] % 3})
    assert swept.level is None
    assert swept.convergence.tolist() == [k % 3 for k in range(len(swept))]
    assert swept.share_rest_states == (varied is GRID)


def test_each_variant_has_its_own_level(members):
    vary = {"controller.variant": {"values": ["free", "visco-elastic"]}} | GRID
    swept = members(vary)
    # The energies at rest of made up members are 1 J.
    bounds = {"visco-elastic": 8.0}
    swept.__dict__["_certified"] = SimpleNamespace(bounds=bounds)
    assert swept.level.tolist() == pytest.approx([np.nan] * 20 + [7.0] * 20, nan_ok=True)


@pytest.mark.parametrize("missing", ["settling_time", "steps"])
def test_a_sweep_without_a_column_is_no_sweep(made, missing):
    file = made(GRID).path
    manifest = file.parent / "manifest.json"
    data = json.loads(manifest.read_text())
    data["columns"].remove(missing)
    manifest.write_text(json.dumps(data))
    with pytest.raises(NotAResultError, match="is damaged"):
        read_members(file)


@pytest.mark.parametrize("changes", [{"linspace": [-2, 2, 6]}, {"values": [1]}])
def test_a_plan_of_other_members_is_not_taken(made, monkeypatch, changes):
    other = load_plan({"base": plain(VISCO_ELASTIC), "vary": GRID | {f"{SPIN}[0]": changes}})
    monkeypatch.setattr("rbstab.sweep.folder.members_file.plan_yaml", lambda _: plan_yaml(other))
    assert read_members(made(GRID).path).plan is None


def test_texts_of_others_are_told_in_one_line(made):
    title = "evil\u202e\n<script>"
    sections = sweep_sections(made(GRID, title=title))
    check_sections(sections)
    assert "\u202e" not in sections[0].title
    assert "\n" not in sections[0].title
    assert "<script>" in dict(texts(tables(sections)["sweep-1-facts"]))["title"]


def test_what_is_known_of_a_member_now_is_read(made):
    """Its shard says what was proved of its motion when it was computed: nothing."""
    file = made(GRID, lambda a: {"proved_rest_state": 0 * a["run"]}, prove="motion").path
    assert "proved_rest_state" in json.loads((file.parent / "manifest.json").read_text())["columns"]
    say_proved(file.parent, (3, 17))
    for table in (read_sweep(file), read_sweep(file, ["proved_rest_state"])):
        assert np.flatnonzero(table["proved_rest_state"]).tolist() == [3, 17]
