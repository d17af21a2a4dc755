"""Make the stored sweeps of format 1 again, from their plans, after the format has changed.

Run `python tests/formats/remake.py` before the first release only; then put the printed digest into
`test_stored_format_1.py`. From then on, what users have stays readable.
"""

import hashlib
import json
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

from click.testing import CliRunner

from rbstab_cli.main import cli

STORED = Path(__file__).parent / "data" / "format_1"

SWEEPS: dict[str, tuple[str, ...]] = {
    "finished_map": (),
    "finished_variants": (),
    "begun_map": (),
    "first_part_of_variants": ("--part", "1/2"),
}
"""Each stored sweep, and with what options it is run."""

LOST = ("shards/00000001.h5", "shards/00000003.h5", "members.h5")
"""What a sweep lacks that was only begun."""


def remake(name, temporary):
    """Run the plan of a stored sweep again in its folder."""
    folder, plan = STORED / "sweeps" / name, temporary / f"{name}.yaml"
    shutil.copy(folder / "plan.yaml", plan)
    size = str(json.loads((folder / "manifest.json").read_text())["shard_size"])
    shutil.rmtree(folder)
    words = ["sweep", str(plan), "-o", str(folder.parent), "--no-prove", "-q"]
    done = CliRunner().invoke(cli, [*words, "--shard-size", size, *SWEEPS[name]])
    assert done.exit_code == 0, done.output
    for lost in LOST if name.startswith("begun") else ():
        (folder / lost).unlink()
    (folder / ".lock").unlink()


def digest():
    """Return the digest of all stored files."""
    hasher = hashlib.sha256()
    for path in sorted(STORED.rglob("*")):
        if path.is_file():
            content = hashlib.sha256(path.read_bytes()).hexdigest()
            hasher.update(json.dumps([str(path.relative_to(STORED)), content]).encode())
    return hasher.hexdigest()


if __name__ == "__main__":
    with TemporaryDirectory() as made:
        for each in SWEEPS:
            remake(each, Path(made))
    print(digest())  # noqa: T201 (a script)
