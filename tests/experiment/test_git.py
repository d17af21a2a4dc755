"""Protects the provenance of a checkout whose branch has a name outside the locale."""

import os
import subprocess
import sys

import pytest

BRANCH = "größe-θ"

ASK = """
import sys
from pathlib import Path
from rbstab.experiment.provenance import _git
print(ascii(_git(Path(sys.argv[1]), "branch", "--show-current")))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="its locale is no environment variable")
def test_names_of_branches_are_utf_8(tmp_path):
    """In the C locale, Python reads ASCII; on Windows, one of its own encodings."""
    subprocess.run(["git", "init", "-q", "-b", BRANCH, tmp_path], check=True)
    locale = {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}
    done = subprocess.run(
        [sys.executable, "-c", ASK, tmp_path],
        env=os.environ | locale,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.strip() == ascii(BRANCH), done.stderr
