"""The commands that a report of a sweep names."""

from pathlib import Path

from rbstab.files.existence import is_file
from rbstab.files.shell_words import shell_word
from rbstab.sweep.folder.member_answers import proving_command
from rbstab.sweep.folder.sweep_folder import PLAN_FILE
from rbstab.sweep.plan.plan import Plan


def member_command(path: Path) -> str:
    """Return the command that runs a member of a sweep as a single run; its number follows.

    Args:
        path: The file of the sweep. If no plan is beside it, the command names PLAN.yaml.
    """
    return f"rbstab run {_plan(path)} --member"


def proof_command(path: Path, plan: Plan | None) -> str:
    """Return the command that proves what is not yet proved of a sweep, up to the last body.

    Args:
        path: As for `member_command`.
        plan: The plan of the sweep; None if it cannot be read.
    """
    return proving_command(path.parent, plan)


def _plan(path: Path) -> str:
    plan = path.parent / PLAN_FILE
    return shell_word(plan) if is_file(plan) else "PLAN.yaml"
