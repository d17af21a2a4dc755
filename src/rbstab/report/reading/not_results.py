"""Say what a file is that was named in place of a result: a config, a plan, or a proof."""

from contextlib import suppress
from pathlib import Path

from rbstab.config.errors import ConfigError
from rbstab.config.source import YAML
from rbstab.experiment.proof_cache import PROOFS
from rbstab.files.existence import is_file
from rbstab.files.shell_words import shell_word
from rbstab.sweep.folder.manifest import MANIFEST
from rbstab.sweep.plan.load import is_config, is_plan

RESULT = ".h5"

CONFIG, PLAN, PROOF = "a config", "the plan of a sweep", "a proof"

PARTS = {MANIFEST: "the manifest of a sweep"}
"""What the JSON files in the folder of a sweep are, by their names."""

COMMANDS = {
    CONFIG: "Run it: rbstab run",
    PLAN: "Run it: rbstab sweep",
    PROOF: "Look at it: rbstab show",
}
"""What to do with a file that is not a result."""


def what_it_is(path: Path) -> str | None:
    """Return what a file is, told by its name, place and text; None if it may be a result.

    Raises:
        OSError: The disk reports an error.
    """
    if not is_file(path):
        return None
    if path.suffix.lower() in YAML:
        try:
            return PLAN if is_plan(path) else CONFIG
        except ConfigError:
            return "a YAML file"
    if path.suffix.lower() == ".json":
        return _json(path)
    if path.suffix.lower() != RESULT:
        # A config may have any name.
        with suppress(ConfigError):
            return PLAN if is_plan(path) else CONFIG if is_config(path) else None
    return None


def _json(path: Path) -> str | None:
    folder = path.absolute().parent
    if folder.name == PROOFS:
        return PROOF
    return PARTS.get(path.name) if is_file(folder / MANIFEST) else None


def not_a_result(path: Path) -> str | None:
    """Return what a file is that is not a result, and what to do with it; None for others."""
    what = what_it_is(path)
    if what is None:
        return None
    if what in PARTS.values():
        return f"is {what}, not a result. Look at the sweep: rbstab show {shell_word(path.parent)}"
    command = f". {COMMANDS[what]} {shell_word(path)}" if what in COMMANDS else ""
    return f"is {what}, not a result{command}"
