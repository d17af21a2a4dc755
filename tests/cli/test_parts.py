"""Protects `rbstab sweep --part`: processes share one sweep, and a last command finishes it."""

from pathlib import Path

import pytest
from cli.conftest import ended, json_of, rbstab, success
from support import missing_heyoka
from support.printed_paths import words_of
from support.sweeping import digest_of
from support.sweeps import shard_files

PLAN = """\
title: Spins
base: good.yaml
vary:
  initial.angular_velocity[0]: {linspace: [-4, 4, 20]}
"""

SWEEP = ("sweep", "--no-prove", "plan.yaml", "--engine", "scipy", "--shard-size", "4")

FINISH = ("sweep", "--no-prove", "results/plan/plan.yaml")


def test_parts_and_what_finishes_them(use_fake_engine):
    whole = rbstab(*SWEEP, "-o", "whole")
    for number, shards in ((1, 3), (2, 2)):
        done = success(*SWEEP, "--part", f"{number}/2")
        message = f"{shards} of {shards} shards of part {number}/2 are stored."
        assert message in done.stderr
        assert "run: rbstab sweep results/plan/plan.yaml\n" in done.stderr.replace("\\", "/")
        words = [line.split() for line in done.stdout.splitlines()]
        assert ["completed", str(4 * shards), "100.00%"] in words
        assert not Path("results/plan/members.h5").exists()
    status = json_of("sweep", "--status", "results/plan")
    assert (status["done"], status["finished"]) == (20, False)
    finished = rbstab(*FINISH)
    assert (finished.exit_code, finished.stdout) == (0, whole.stdout)
    assert "20 of 20 members are already done" in finished.stderr
    assert "-> results/plan/members.h5" in finished.stderr.replace("\\", "/")
    assert shard_files(Path("results/plan")) == shard_files(Path("whole/plan"))
    assert digest_of(Path("results/plan")) == digest_of(Path("whole/plan"))
    shown = rbstab("sweep", "--status", "results/plan").stdout
    assert ["finished", "yes"] in [line.split() for line in shown.splitlines()]


@missing_heyoka.NEEDED
def test_the_comparison_is_made_when_the_sweep_is_finished(plan):
    options = ("sweep", "--no-prove", "plan.yaml", "--engine", "heyoka", "--shard-size", "10")
    for number in (1, 2):
        success(*options, "--part", f"{number}/2")
    finished = success(*FINISH, "--compare", "6")
    assert "6 members, largest relative difference" in finished.stdout


@pytest.mark.parametrize(
    ("place", "sweep"),
    [(".", "other place/plan"), ("other place", "plan"), ("other place/plan", ".")],
)
def test_the_command_that_resumes_a_sweep_works_as_typed(
    use_fake_engine, place, sweep, monkeypatch
):
    rbstab(*SWEEP, "--part", "1/3", "-o", "other place")
    file = Path("other place/plan/members.h5").absolute()
    monkeypatch.chdir(place)
    program, *words = words_of(rbstab("show", sweep).stderr.removeprefix("Next: "))
    assert program == "rbstab"
    refused = rbstab("report", sweep, "--format", "text").stderr
    assert words_of(refused.partition("Resume it: ")[2].splitlines()[0])[1:] == words
    assert not file.exists()
    success(*words, "--no-prove")
    assert file.exists()


def test_exit_codes_of_a_part(use_fake_engine):
    use_fake_engine(failing=range(20))
    ended(3, *SWEEP, "--part", "1/2")
    success(*SWEEP, "--part", "9/9", "-o", "other")  # an empty part
    use_fake_engine(failing=(5,))
    failed = ended(3, *SWEEP, "--part", "2/2", "--fail-fast", "--threads", "1")
    assert "member 5 failed; 1 of 2 shards of part 2/2 are stored" in failed.stderr
    size = ended(2, *SWEEP[:-1], "5", "--part", "2/2")
    assert "started with shards of 4 members" in size.stderr


def test_a_scheduler_that_does_not_answer(plan, monkeypatch):
    monkeypatch.setattr("rbstab.sweep.execution.dask_cluster.TIME_LIMIT", 0.5)
    refused = ended(2, *SWEEP, "--dask", "tcp://127.0.0.1:9")
    assert "--dask tcp://127.0.0.1:9: the scheduler cannot be reached" in refused.stderr
    assert not Path("results").exists()
