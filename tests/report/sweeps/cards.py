"""The answers about a made up sweep."""

from rbstab.report.sweeps.answers import answer_of
from rbstab.report.sweeps.commands import Commands

COMMANDS = Commands("rbstab run PLAN --member", "rbstab sweep PLAN --prove")


def answered(members):
    """Return the answers about a sweep."""
    return answer_of("sweep-1", "made", members, COMMANDS)
