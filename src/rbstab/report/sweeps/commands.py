"""The commands that a report of a sweep names."""

from pathlib import Path
from typing import NamedTuple

from rbstab.files.existence import is_file
from rbstab.files.shell_words import shell_word
from rbstab.sweep.folder.member_answers import proving_command
from rbstab.sweep.folder.sweep_folder import PLAN_FILE
from rbstab.sweep.plan.plan import Plan


class Commands(NamedTuple):
    """The commands of a sweep.

    Attributes:
        member: It runs a member as a single run; the number of the member follows.
        proof: It proves what is not yet proved, up to the last body.
    """

    member: str
    proof: str


def commands_of(path: Path, plan: Plan | None) -> Commands:
    """Return the commands of a sweep.

    Args:
        path: The file of the sweep. If no plan is beside it, a command names PLAN.yaml.
        plan: The plan of the sweep; None if it cannot be read.
    """
    file = path.parent / PLAN_FILE
    word = shell_word(file) if is_file(file) else "PLAN.yaml"
    return Commands(f"rbstab run {word} --member", proving_command(path.parent, plan))
