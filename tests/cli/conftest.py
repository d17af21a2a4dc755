"""A working folder, plans, a fake engine, and the command line in this process or in its own."""

import functools
import json
import pkgutil
import signal
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages
from typing import Any

import pytest
from click.testing import CliRunner
from support.sweeps import FakeEngine

from rbstab_cli import work
from rbstab_cli.main import cli
from rbstab_cli.output.progress import Work
from rbstab_cli.work.sweeps import progress as sweep_progress

GOOD = """\
title: A short run
body: {mass: 41, inertia: [10.0, 9.0, 2.0], contact_point: [0.15, 0.10, -0.42]}
controller:
  variant: free
  K_t: [4100, 4100, 3280]
  L_t: [200, 200, 140]
  K_r: [400, 400, 320]
  L_r: [60, 60, 42]
initial: {angular_velocity: [1, 2, -1]}
integration: {duration: 0.1, samples: 11}
"""

PLAN_OF_MASSES = "base: good.yaml\nvary: {body.mass: {values: [40, 41]}}\n"

STORED = Path(__file__).parents[1] / "formats/data/format_1"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty working folder with one valid config, `good.yaml`."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "good.yaml").write_text(GOOD)
    return tmp_path


def rbstab(*arguments):
    """Call the command line in this process."""
    return CliRunner().invoke(cli, list(arguments), prog_name="rbstab")


def ended(code, *arguments):
    """Call the command line in this process; fail the test if it does not end with the code."""
    done = rbstab(*arguments)
    assert done.exit_code == code, done.output
    return done


success = functools.partial(ended, 0)


def json_of(*arguments):
    """Call the command line in this process, and return what it prints as JSON."""
    return json.loads(rbstab(*arguments, "--json").stdout)


def replace_everywhere(monkeypatch, name, new):
    """Replace a function in its module, and in the modules of the commands that import it."""
    for info in walk_packages(work.__path__, f"{work.__name__}."):
        import_module(info.name)
    old = pkgutil.resolve_name(name)
    monkeypatch.setattr(name, new)
    for module in [loaded for key, loaded in sys.modules.items() if key.startswith("rbstab_cli.")]:
        for attribute, value in list(vars(module).items()):
            if value is old:
                monkeypatch.setattr(module, attribute, new)


@pytest.fixture
def refuse(monkeypatch):
    """A function that lets calls of a function, or of several of rbstab, fail."""

    def use(*names: str, error: Exception | None = None) -> None:
        def fail(*_: object, **__: object) -> None:
            raise error or AssertionError("the command began its work")

        for name in names:
            replace_everywhere(monkeypatch, f"rbstab.{name}", fail)

    return use


@pytest.fixture
def no_runs(refuse):
    """Let every run, sweep and proof fail the test."""
    refuse(
        "experiment.run_to_file.simulate_problem",
        "experiment.proof_cache.proof_for",
        "sweep.sweep.sweep_to_folder",
        "sweep.folder.open_folder.sweep_bytes",
    )


@pytest.fixture
def no_work(no_runs, refuse):
    """Let every computation fail the test."""
    refuse(
        "experiment.tuning.tune.tune",
        "experiment.tuning.fit.fit",
        "experiment.tuning.sensitivities.sensitivities",
        "experiment.tuning.guard.guard",
        "experiment.stability.stability_of",
        "report.build.report_of",
    )


@pytest.fixture
def statuses(monkeypatch):
    """What long work says of itself from now on, without waiting for its lines."""
    said: list[str] = []
    monkeypatch.setattr(sweep_progress, "UPDATE_INTERVAL", 0.0)
    monkeypatch.setattr(Work, "update", lambda _work, status, *_fraction: said.append(status))
    return said


@pytest.fixture
def plan(folder, request):
    """The plan `plan.yaml` in the working folder, with the text PLAN of the test module."""
    path = folder / "plan.yaml"
    path.write_text(request.module.PLAN)
    return path


@pytest.fixture
def use_fake_engine(monkeypatch, plan):
    """A function that replaces the engine of sweeps by a fake one; called once without failures."""

    def use(**arguments: Any) -> None:
        factory = functools.partial(FakeEngine, **arguments)
        monkeypatch.setattr("rbstab.sweep.sweep.factory_for", lambda _: factory)

    use()
    return use


def restore_interrupts():
    """React to interrupts: the background processes of a shell ignore them."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def start(*arguments):
    """Start the command line in its own process, which reacts to interrupts."""
    return subprocess.Popen(
        [sys.executable, "-m", "rbstab_cli", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=restore_interrupts if sys.platform != "win32" else None,  # noqa: PLW1509 no threads here
    )
