"""A test run with a time of its own leaves tests out when it is over, and counts them."""

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

from support.time_left import OVER, shuffle_files

TESTS = Path(__file__).parents[1]


def test_tests_are_counted_that_were_not_started():
    chosen = ["tests/support/test_tiers.py", "-p", "no:cacheprovider", "-n", "1"]
    command = [sys.executable, "-m", "pytest", *chosen, "--minutes"]
    outputs = {
        minutes: subprocess.run(
            [*command, minutes], cwd=TESTS.parent, capture_output=True, text=True, check=False
        )
        for minutes in ("-1", "60")
    }
    assert [done.returncode for done in outputs.values()] == [0, 0]
    assert OVER in outputs["-1"].stdout
    assert "passed" not in outputs["-1"].stdout
    assert OVER not in outputs["60"].stdout
    assert "passed" in outputs["60"].stdout


def test_another_commit_begins_with_other_files():
    items = [
        SimpleNamespace(nodeid=f"tests/{name}.py::test_{k}") for name in "abcdef" for k in "12"
    ]
    orders = set()
    for commit in ("1", "2", "3"):
        shuffle_files(items, commit)
        orders.add("".join(item.nodeid[6] for item in items))
    assert len(orders) == 3
    # The tests of a file stay together, in their order.
    assert all(item.nodeid.endswith("12"[k % 2]) for k, item in enumerate(items))
