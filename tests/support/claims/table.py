"""The stored table: the configs, and what was claimed about them when it was made."""

import json
from pathlib import Path
from typing import Any

from rbstab.config.load import load_config

ROOT = Path(__file__).resolve().parents[3]
FOLDER = ROOT / "tests/claims"
TABLE = FOLDER / "claims.json"
BODIES = FOLDER / "bodies.json"
"""The configs of random bodies of all kinds, by name: what holds the body, and its elements.

Some have one rest state, and some have several. They were drawn once. The files of elements are
relative to the root.
"""


def names():
    """Return the names of all configs: paths of those that are shipped, then the random ones."""
    return [*shipped(), *read(BODIES)]


def shipped():
    """Return the paths of the shipped configs, relative to the root; plans of sweeps are none."""
    folders = (ROOT / "configs/paper", ROOT / "configs/examples")
    paths = sorted(path for folder in folders for path in folder.rglob("*.yaml"))
    return [path.relative_to(ROOT).as_posix() for path in paths]


def config_of(name, bodies=None):
    """Return the config of a name; the files of elements may be run."""
    if name.endswith(".yaml"):
        return load_config(ROOT / name, allow_python=True)
    data = (read(BODIES) if bodies is None else bodies)[name]
    for element in data.get("elements", {}).values():
        if "file" in element:
            element["file"] = str(ROOT / element["file"])
    return load_config(data, allow_python=True)


def read(file):
    """Return a stored table, by name."""
    claims: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return claims


def write(file, table):
    """Write a table with one line a name."""
    lines = [f"{json.dumps(name)}: {_line(entry)}" for name, entry in table.items()]
    file.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


def _line(entry):
    return json.dumps(entry, ensure_ascii=False)
