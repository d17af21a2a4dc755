"""The answer of a sweep: how many members return, from which value on, and what is better?"""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rbstab.experiment.answers.run_answer import SETTLED, SETTLED_DRIVEN
from rbstab.experiment.answers.words import words_with_meanings
from rbstab.files.paths import is_file
from rbstab.files.text import shell_word
from rbstab.report.model.document import Card, Cards, Statement
from rbstab.report.sweeps.conditions.ranking import ranking_sentences
from rbstab.report.sweeps.members import LEFT_RANGE, RETURNS, Members
from rbstab.sweep.folder.member_answers import proving_command
from rbstab.sweep.folder.sweep_folder import PLAN_FILE
from rbstab.sweep.members.outcome import STATUSES
from rbstab.sweep.plan.plan import Plan

SYMBOLS = (
    ("at rest", f"{SETTLED} to the end of the run; where elements supply power, {SETTLED_DRIVEN}"),
    ("tilt", "the angle of the rotation between the attitude of the body and the desired one"),
    ("E1, E2, E3", "the displacement of the contact point from its anchor, by axis"),
    ("v", "the Lyapunov function, an energy: 0 at rest; v(0) is its value at the start"),
    ("θ2", "the second Euler angle; its range ends at ±π/2 rad, a right angle"),
)
"""The symbols of a report of a sweep, and their meanings."""


class Commands(NamedTuple):
    """The commands of a sweep.

    Attributes:
        member: It runs a member as a single run; the number of the member follows.
        proof: It proves what is not yet proved, up to the last body.
    """

    member: str
    proof: str


class SweepAnswer(NamedTuple):
    """What a reader wants to know first of a sweep.

    Attributes:
        sentences: How many members return, and from which value of a parameter on; which ended
            early; which condition is better.
        card: The first of these, to stand beside those of other results.
    """

    sentences: tuple[str, ...]
    card: Card


def answer_of(name: str, label: str, members: Members, commands: Commands) -> SweepAnswer:
    """Return the answers about a sweep.

    Args:
        name: The anchor of the sweep.
        label: Its label.
        members: Its members.
        commands: Its commands.
    """
    outcomes = members.sweep_outcomes
    # A count of those that are proved stands in the sentence.
    sure = "seen, not proved" if members.outcome_counts[RETURNS] and not outcomes.proved else ""
    parts = [outcomes.sentence, sure, f"Desired: {outcomes.aim}"]
    answer = " ".join(f"{_capital(part)}." for part in (*parts, outcomes.deciding) if part)
    tone = "good" if outcomes.all_return else ""
    statement = Statement("How many members return?", outcomes.brief, answer, tone)
    sentences = (answer, *_early(members, commands.member), *ranking_sentences(members))
    return SweepAnswer(sentences, Card(label, (statement,), target=name))


def commands_of(path: Path, plan: Plan | None) -> Commands:
    """Return the commands of a sweep.

    Args:
        path: The file of the sweep. If no plan is beside it, a command names PLAN.yaml.
        plan: The plan of the sweep; None if it cannot be read.
    """
    file = path.parent / PLAN_FILE
    word = shell_word(file) if is_file(file) else "PLAN.yaml"
    return Commands(f"rbstab run {word} --member", proving_command(path.parent, plan))


def cards_of(name: str, cards: Sequence[Card]) -> Cards:
    """Return the cards of sweeps as a block with this name, with what their words mean."""
    return Cards(name, tuple(cards), (*words_with_meanings(), *SYMBOLS))


def _early(members: Members, command: str) -> list[str]:
    """Return the command that runs the first member that ended early."""
    early = np.flatnonzero(members.outcomes >= LEFT_RANGE)
    if not len(early):
        return []
    first = int(early[0])
    status = STATUSES[members.column("status")[first]]
    return [f"The first that ended early is member {first} ({status}): {command} {first}"]


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
