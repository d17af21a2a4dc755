"""Protects sweeps of elements of users: workers get text and permission, columns have units."""

from dataclasses import replace

import numpy as np
import pytest
from support.switching import data
from support.user_code import SPRING, python_section

from rbstab.config.errors import ConfigError
from rbstab.config.load import run_id
from rbstab.config.user_code.permission import CodeNotAllowedError
from rbstab.sweep.execution.computing import Task
from rbstab.sweep.folder.member_answers import proving_command
from rbstab.sweep.folder.members_file import varied_columns
from rbstab.sweep.folder.sweep_table import read_sweep
from rbstab.sweep.options import SweepOptions
from rbstab.sweep.plan.load import load_plan, plan_to_read, plan_yaml
from rbstab.sweep.plan.plan import plan_id
from rbstab.sweep.proofs.variants import without_theorem
from rbstab.sweep.sweep import sweep_to_folder

KEY = "elements.mine.parameters.k"

VARIED = {KEY: {"values": [1.0, 2.0, 4.0]}, "initial.velocity[0]": {"values": [0.5, 1.0]}}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A working folder with the file of the element."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(SPRING)
    return tmp_path


def plan_of(engine="scipy", **changes):
    integration = {"engine": engine, "duration": 1.0, "samples": 11}
    start = {"position": [0.3, 0, 0]}
    base = data({"mine": python_section(k=3.0)}, start, integration)
    return load_plan({"base": base, "vary": VARIED, **changes}, allow_python=True)


def expected(plan):
    """x = 0.3 cos ωt + (v/ω) sin ωt at the end, with ω² = k/m."""
    values = plan.values(0, plan.members)
    omega = np.sqrt(values[KEY] / plan.base_of("none").body.mass)
    v = values["initial.velocity[0]"]
    return 0.3 * np.cos(omega) + v / omega * np.sin(omega)


@pytest.mark.parametrize(("engine", "threads"), [("scipy", 1), ("scipy", 2), ("heyoka", 1)])
def test_all_members_in_closed_form(folder, engine, threads):
    """With two threads, the second one has a worker process."""
    if engine == "heyoka":
        pytest.importorskip("heyoka")
    plan = plan_of(engine, keep="traces")
    (folder / "mine.py").unlink()  # the plan has its text
    options = SweepOptions(threads=threads, shard_size=2)
    done = sweep_to_folder(plan, folder / "sweep", options)
    assert done.finished
    table = read_sweep(folder / "sweep" / "members.h5", ("final_position", "status"))
    assert (table["status"] == 0).all()
    np.testing.assert_allclose(table["final_position"][:, 0], expected(plan), atol=1e-9)


def test_the_plan_needs_no_file_and_gives_no_permission(folder):
    plan = plan_of()
    (folder / "mine.py").unlink()
    stored = folder / "plan.yaml"
    stored.write_text(plan_yaml(plan))
    assert plan_id(load_plan(stored, allow_python=True)) == plan_id(plan)
    with pytest.raises(ConfigError, match="--allow-python"):
        load_plan(stored)
    read = plan_to_read(stored)
    assert plan_id(read) == plan_id(plan)
    assert not read.may_run_code
    with pytest.raises(CodeNotAllowedError):
        _ = read.initial_value_problems
    config = plan.config_of(5)
    assert run_id(read.config_of(5)) == run_id(config)
    assert config.elements["mine"].parameters == {"k": 4.0}


def test_a_reader_without_permission_does_not_say_that_no_theorem_covers_the_members(folder):
    """Proofs are made by the sweep, which may run the code: missing ones were not reached."""
    (folder / "sweep").mkdir()
    stored = folder / "sweep" / "plan.yaml"
    stored.write_text(plan_yaml(plan_of()))
    read = plan_to_read(stored)
    assert without_theorem(read) == {}
    assert proving_command(stored.parent, read).endswith(" --prove --allow-python")
    assert proving_command(stored.parent, None).endswith(" --prove")


def test_columns_have_units(folder):
    columns = varied_columns(plan_of(), 0, 1)
    assert columns["elements_mine_parameters_k"].unit == "N/m"


@pytest.mark.parametrize("allowed", [True, False])
def test_a_worker_gets_the_permission_of_the_sender(folder, allowed):
    plan = plan_of()
    task = replace(Task.of(plan, None, elsewhere=True), allow_python=allowed)
    if not allowed:
        with pytest.raises(ConfigError, match="--allow-python"):
            task(0, 2)
        return
    computed = task(0, 2)
    assert not computed.error
    positions = computed.shard.outcome["final_position"][:, 0]
    np.testing.assert_allclose(positions, expected(plan)[:2], atol=1e-9)
