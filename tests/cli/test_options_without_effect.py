"""Protects against options that are ignored without a word: each is refused, and named."""

from pathlib import Path

import pytest
from cli.conftest import Invoke

PLAN = "base: good.yaml\nvary: {body.mass: {values: [40, 41]}}\n"

BESIDE_STATUS = {
    "-o": ("-o", "results"),
    "--set": ("--set", "body.mass=50"),
    "--engine": ("--engine", "scipy"),
    "--threads": ("--threads", "1"),
    "--shard-size": ("--shard-size", "1"),
    "--part": ("--part", "1/2"),
    "--dask": ("--dask", "localhost:1"),
    "--dry-run": ("--dry-run",),
    "--retry-failed": ("--retry-failed",),
    "--fail-fast": ("--fail-fast",),
    "--compare": ("--compare", "5"),
    "--prove": ("--prove",),
    "--force": ("--force",),
    "--allow-python": ("--allow-python",),
}


@pytest.mark.usefixtures("plan")
@pytest.mark.parametrize("option", BESIDE_STATUS)
def test_beside_status(option: str, rbstab: Invoke) -> None:
    done = rbstab("sweep", "--status", "results/plan", *BESIDE_STATUS[option])
    assert done.exit_code == 2
    assert f"Error: --status runs nothing, so it has no use for {option}\n" in done.stderr


@pytest.mark.usefixtures("plan")
def test_every_option_beside_status_is_named(rbstab: Invoke) -> None:
    done = rbstab("sweep", "--status", "results/plan", "--force", "--set", "a=1", "--fail-fast")
    assert done.stderr.endswith("no use for --set, --fail-fast, --force\n")


def test_all_options_of_sweep_are_tested() -> None:
    from rbstab_cli.commands.sweep import BESIDE_STATUS as ALLOWED
    from rbstab_cli.commands.sweep import command

    names = {p.opts[0] for p in command.params if p.name not in ALLOWED}
    assert names == {*BESIDE_STATUS, "--shard"}


@pytest.mark.usefixtures("plan", "use_fake_engine")
def test_status_as_json_and_quiet(rbstab: Invoke) -> None:
    assert rbstab("sweep", "plan.yaml", "-q").exit_code == 0
    assert rbstab("sweep", "--status", "results/plan", "--json", "-q").exit_code == 0


@pytest.mark.usefixtures("plan")
@pytest.mark.parametrize(
    "arguments", [("sweep", "plan.yaml"), ("run", "plan.yaml", "--member", "0")], ids=" ".join
)
def test_a_key_that_the_plan_varies(arguments: tuple[str, ...], rbstab: Invoke) -> None:
    done = rbstab(*arguments, "--set", "body.mass=50")
    assert done.exit_code == 2
    assert done.stderr == (
        "--set body.mass:1:1: body.mass: has no effect, because the plan varies it "
        "(expected a key that the plan does not vary)\n"
    )
    assert not Path("results").exists()


@pytest.mark.usefixtures("plan")
@pytest.mark.parametrize(
    "arguments",
    [
        ("sweep", "plan.yaml"),
        ("sweep", "plan.yaml", "--engine", "heyoka"),
        ("run", "good.yaml", "--engine", "heyoka"),
    ],
    ids=" ".join,
)
def test_an_engine_that_another_option_replaces(arguments: tuple[str, ...], rbstab: Invoke) -> None:
    done = rbstab(*arguments, "--set", "integration.engine=scipy")
    assert done.exit_code == 2
    assert "--set integration.engine has no effect here. Use only --engine." in done.stderr
