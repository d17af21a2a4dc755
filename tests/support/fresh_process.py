"""Scripts in fresh Python processes, where nothing is shared but the environment."""

import os
import subprocess
import sys


def printed_with_hash_seeds(script, path):
    """Run a script on a file under two hash seeds, and return what the processes print.

    The hash seed decides the order of sets: a name that depends on it is printed twice.
    """
    outputs = set()
    for seed in ("1", "42"):
        done = subprocess.run(
            [sys.executable, "-c", script, str(path)],
            env=os.environ | {"PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
            timeout=60,
        )
        outputs.add(done.stdout.strip())
    return outputs
