"""Protects users from code in results and plans of others: only --allow-python ever runs it.

Each file, class body and statement below leaves a marker when it runs. The results are made here
with permission; then the marker is removed, and everything that reads or resumes them is called.
"""

import json
import shutil
import sys
from pathlib import Path

import pytest
from cli.conftest import GOOD, rbstab, success
from support.user_code import traitor

import rbstab as package
from rbstab.config.errors import ConfigError
from rbstab.config.user_code.permission import CodeNotAllowedError
from rbstab.elements.user_code import loaded
from rbstab.experiment.proof import CODE_NOT_RUN
from rbstab.experiment.stored_run import stored_config
from rbstab.experiment.summary import summary_of
from rbstab_cli.commands.beginning import check as check_command
from rbstab_cli.commands.proofs import stability
from rbstab_cli.commands.running import run, sweep
from rbstab_cli.commands.tuning import fit, guard, sensitivities, tune
from rbstab_cli.registry import COMMANDS

CONFIG = GOOD.replace("title: A short run", "schema_version: 2\ntitle: A traitor") + (
    "elements:\n  mine: {kind: python, file: mine.py, class: Mine, parameters: {k: 3}}\n"
)

PLAN = """\
base: traitor.yaml
vary:
  elements.mine.parameters.k: {values: [1, 2, 3]}
  initial.velocity[0]: {values: [0, 0.1]}
keep: traces
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with a result, a proof and a sweep of traitors, made with permission."""
    folder = tmp_path_factory.mktemp("made")
    (folder / "mine.py").write_text(traitor(folder / "ran"))
    (folder / "traitor.yaml").write_text(CONFIG)
    (folder / "plan.yaml").write_text(PLAN)
    allowed = ("--allow-python", "-q", "--engine", "scipy")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert rbstab("run", "traitor.yaml", "--prove", *allowed).exit_code == 0
        assert rbstab("sweep", "plan.yaml", "--threads", "1", *allowed).exit_code == 0
    assert (folder / "ran").exists()
    return folder


@pytest.fixture
def marker(made, tmp_path, monkeypatch):
    """The marker, which is not there; a copy of the folder is the working folder."""
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    (made / "ran").unlink(missing_ok=True)
    # The results came from somewhere else: this process has never run their code.
    loaded.module_of.cache_clear()
    loaded.element_class.cache_clear()
    for name in [name for name in sys.modules if name.startswith("rbstab_user_code_")]:
        del sys.modules[name]
    return made / "ran"


READING = [
    ("show", "results/traitor.h5"),
    ("show", "results/traitor.h5", "--config"),
    ("report", "results/traitor.h5", "results/plan", "-o", "report.html"),
    ("report", "results/traitor.h5", "-o", "report.pdf"),
    ("plot", "results/traitor.h5", "results/plan"),
    ("sweep", "--status", "results/plan"),
    ("list", "results"),
    ("compare", "results/traitor.h5", "results/traitor.h5"),
]


@pytest.mark.parametrize("arguments", READING, ids=" ".join)
def test_reading_runs_no_code(marker, arguments):
    success(*arguments)
    assert not marker.exists()


RUNNING = [
    ("run", "traitor.yaml"),
    ("run", "results/plan/plan.yaml", "--member", "1"),
    ("check", "traitor.yaml"),
    ("stability", "traitor.yaml"),
    ("stability", "traitor.yaml", "--within", "body.mass=±1%"),
    ("sensitivities", "traitor.yaml"),
    ("tune", "traitor.yaml", "--objective", "settling_time", "--over", "controller.L_t"),
    ("fit", "traitor.yaml", "motion.csv", "--free", "controller.L_t"),
    ("guard", "traitor.yaml"),
    ("sweep", "plan.yaml"),
    ("sweep", "plan.yaml", "--dry-run"),
    ("sweep", "results/plan/plan.yaml", "-o", "again"),
]


@pytest.mark.parametrize("arguments", RUNNING, ids=" ".join)
def test_running_needs_the_option(marker, arguments):
    done = rbstab(*arguments)
    assert done.exit_code == 2
    assert "--allow-python" in done.stderr
    assert "mine.py" in done.stderr or "code of a user" in done.stderr
    assert not marker.exists()


def test_verify_runs_no_code(marker):
    """One of the proofs is that of the config. What would need its code is not checked."""
    proofs = list(Path("results/proofs").glob("*.json"))
    assert len(proofs) > 1  # those of the run and of the members
    outputs: dict[int, str] = {}
    for proof in map(str, proofs):
        rbstab("verify", proof, "--config", "results/plan/plan.yaml")
        done = rbstab("verify", proof, "--config", "traitor.yaml")
        outputs[done.exit_code] = done.stdout
        assert not marker.exists()
    assert sorted(outputs) == [0, 4]
    assert "may not run without --allow-python" in outputs[0]


def test_the_stored_config_as_a_config(marker):
    """It has the text of the file in it, and needs permission all the same."""
    text = rbstab("show", "results/traitor.h5", "--config").stdout
    Path("stored.yaml").write_text(text)
    Path("mine.py").unlink()
    assert rbstab("run", "stored.yaml").exit_code == 2
    assert not marker.exists()
    done = success("run", "stored.yaml", "--allow-python", "--json", "-q")
    again, first = json.loads(done.stdout), package.open_result("results/traitor.h5")
    assert again[0]["run_id"] == first.run_id
    assert marker.exists()


def test_python(marker):
    result = package.open_result("results/traitor.h5")
    summary_of(result)
    config = stored_config(result).config
    assert config is not None
    with pytest.raises(CodeNotAllowedError):
        package.simulate(config)
    assert package.prove(config).outcome == CODE_NOT_RUN
    package.open_sweep("results/plan")
    package.open_traces("results/plan")
    for call in (package.load_config, package.simulate, package.sensitivities):
        with pytest.raises(ConfigError, match="--allow-python"):
            call("traitor.yaml")
    with pytest.raises(ConfigError, match="--allow-python"):
        package.tune("traitor.yaml", "settling_time", ["controller.L_t"])
    with pytest.raises(ConfigError, match="--allow-python"):
        package.fit("traitor.yaml", "motion.csv", ["controller.L_t"])
    for plan in ("plan.yaml", "results/plan/plan.yaml"):
        with pytest.raises(ConfigError, match="--allow-python"):
            package.load_plan(plan)
    assert not marker.exists()
    assert package.simulate("traitor.yaml", allow_python=True).status == "completed"
    assert marker.exists()


def test_a_sweep_is_resumed_with_permission_only(marker):
    for shard in Path("results/plan/shards").iterdir():
        shard.unlink()
    Path("results/plan/members.h5").unlink()
    assert rbstab("sweep", "plan.yaml", "--engine", "scipy").exit_code == 2
    assert not marker.exists()
    success("sweep", "plan.yaml", "--engine", "scipy", "--allow-python", "-q", "--threads", "1")
    assert marker.exists()


def test_a_report_elsewhere(marker):
    """Without the file and without the config, as somebody else gets a result."""
    Path("else").mkdir()
    shutil.copy("results/traitor.h5", "else/theirs.h5")
    for name in ("mine.py", "traitor.yaml"):
        Path(name).unlink()
    success("report", "else/theirs.h5", "-o", "else/theirs.html")
    page = Path("else/theirs.html").read_text().replace("<wbr>", "")
    assert "elements.mine.parameters.k [N/m]" in page
    assert "whose code a report never runs" in page
    assert "open(" not in page.partition("<script")[0]
    assert not marker.exists()


def test_every_command_that_builds_equations_has_the_option():
    commands = (check_command, fit, guard, run, sensitivities, stability, sweep, tune)
    for command in commands:
        assert "--allow-python" in [name for p in command.params for name in p.opts]
    reading = {
        "export",
        "show",
        "plot",
        "report",
        "verify",
        "cache",
        "schema",
        "completion",
        "init",
        "examples",
        "list",
        "compare",
    }
    assert reading | {command.name for command in commands} == set(COMMANDS)
