import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from rbstab_cli.main import cli

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

Invoke = Callable[..., Result]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working folder with one good config, `good.yaml`."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "good.yaml").write_text(GOOD)
    return tmp_path


@pytest.fixture
def rbstab() -> Invoke:
    """Calls the command line in this process."""

    def invoke(*arguments: str) -> Result:
        return CliRunner().invoke(cli, list(arguments), prog_name="rbstab")

    return invoke


def start(*arguments: str) -> "subprocess.Popen[str]":
    """Starts the command line as a process of its own, which an interrupt reaches."""

    def heed_interrupts() -> None:
        # A shell starts what runs in its background with interrupts ignored, children included.
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    return subprocess.Popen(
        [sys.executable, "-m", "rbstab_cli", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=heed_interrupts if sys.platform != "win32" else None,  # noqa: PLW1509 no threads here
    )
