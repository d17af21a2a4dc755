"""Disturb commands by a library that makes a system call fail, one call after the other.

The commands are forks of a server that has loaded the library (`control.build`).
"""

import json
import shlex
import shutil
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import NamedTuple

from faults.contents import (
    Content,
    content_of,
    differences,
    files_of,
    missing_pictures,
    partial_files,
)
from faults.judge import (
    Reference,
    file_problems,
    message_problems,
    new_lines,
    unfinished,
)
from faults.library.cases import CASES, INPUTS
from faults.library.control import CONTROL, SHORT, Control, Counts, Fault, build
from support.command_server import PICTURES
from support.forked_commands import CommandServer, Ended

RESULTS = "results"
"""The disturbed folder, in the working folder of a command."""

MAX_SHOWN = 12
"""The largest number of trials that a failed test shows."""


class Trial(NamedTuple):
    """A disturbed command: its case, its fault, what the library did, and what was wrong."""

    case: str
    fault: Fault
    counts: Counts
    ended: Ended
    problems: list[str]

    def __str__(self):
        problems = "".join(f"  - {problem[:500]}\n" for problem in self.problems)
        return (
            f"{self.case}, {self.fault} ({self.counts.first}): exit code {self.ended.code}\n"
            f"{problems}  stderr: {self.ended.stderr[-300:]!r}"
        )


def problems_of(trials):
    """Return the problems of trials as a text, empty if there are none."""
    bad = [trial for trial in trials if trial.problems]
    more = [f"and {len(bad) - MAX_SHOWN} more of {len(trials)} trials"]
    return "\n".join([*map(str, bad[:MAX_SHOWN]), *(more if len(bad) > MAX_SHOWN else [])])


@contextmanager
def running(folder):
    """Build the library, and start a server that has loaded it."""
    variables = build(folder)
    pictures = folder / "pictures"
    pictures.mkdir()
    with CommandServer(folder, environment=variables | {PICTURES: str(pictures)}) as server:
        yield Trials(folder / "work", server, Control(Path(variables[CONTROL])))


class Trials:
    """Disturbed commands in a folder.

    Args:
        folder: A folder that does not exist yet.
        server: Runs the commands.
        control: The control of the library that it has loaded.
    """

    def __init__(self, folder, server, control):
        self.folder = folder
        self.server = server
        self.control = control
        self.templates: dict[tuple[str, ...], Path] = {}
        self.references: dict[str, Reference] = {}
        self.contents: dict[tuple[str, str], Content] = {}
        self.repeated: dict[tuple[str, str], list[str]] = {}
        self.number = 0

    def series(self, case, operation, error="EIO", *, lasting=False, sample=None):
        """Disturb a command at its first call of an operation, its second, ... until none fails.

        Args:
            case: The name of the command.
            operation, error, lasting: See `Fault`.
            sample: The number of calls to disturb, evenly spaced; default all.
        """
        fault = Fault(operation, error, 0, lasting)
        if sample is None:
            return list(self._until_none_fails(case, fault))
        calls = self.trial(case, fault).counts.calls
        steps = max(1, sample - 1)
        numbers = sorted({1 + (calls - 1) * k // steps for k in range(sample)} - {0})
        return [self.trial(case, fault._replace(nth=nth)) for nth in numbers]

    def _until_none_fails(self, case, fault):
        for nth in count(1):
            trial = self.trial(case, fault._replace(nth=nth))
            # Without a fault it made fewer calls; this was one more undisturbed run.
            if trial.counts.faults or trial.ended.code or trial.problems:
                yield trial
            if not trial.counts.faults:
                return

    def trial(self, name, fault):
        """Run a command with a fault, judge what it left, and repeat it without the fault."""
        case, reference = CASES[name], self.reference(name)
        work = self._copy(reference.template)
        self.control.arm(work / RESULTS, fault)
        ended = self._run(case.arguments, work)
        counts = self.control.disarm()
        warned = new_lines(reference, ended) > 0
        problems = self._judge(name, work, ended, case.optional if warned else "-")
        if ended.code == 0 and fault.operation == "fsync" and counts.faults and not warned:
            problems.append("a failed fsync was passed over without a word")
        if ended.code != 0 and fault.error == SHORT:
            problems.append("a short write or read is no error: the rest can be written or read")
        # A writer cannot remove its partial file if removing fails.
        removable = fault.operation != "unlink"
        if removable:
            problems += [f"{name} is left" for name in partial_files(work / RESULTS)]
        problems += self._repeat(name, work, removable=removable)
        shutil.rmtree(work)
        counts = counts._replace(first=counts.first.replace(str(work.resolve()), ""))
        return Trial(name, fault, counts, ended, problems)

    def _run(self, arguments, folder):
        return self.server.run(folder, *shlex.split(arguments))

    def reference(self, name):
        """Return the undisturbed run of a case; it is made at the first call."""
        if name not in self.references:
            self.references[name] = self._make_reference(CASES[name])
        return self.references[name]

    def _make_reference(self, case):
        template = self._template(case.before)
        runs = []
        for _ in range(2):
            work = self._copy(template)
            ended = self._run(case.arguments, work)
            assert ended.code == 0, (case, ended)
            digests = files_of(work / RESULTS)
            assert partial_files(work) == []
            contents = self._contents(work / RESULTS, digests)
            runs.append((ended, digests, contents))
            shutil.rmtree(work)
        (ended, digests, after), (other, _, again) = runs
        for name, content in after.items():
            assert content == again[name], (name, differences(content, again[name]))
        before_files, first = files_of(template / RESULTS), dict[str, Content]()
        if case.first:
            work = self._copy(template)
            assert self._run(case.first, work).code == 0
            first = self._contents(work / RESULTS, files_of(work / RESULTS))
        assert ended.stdout == other.stdout or not case.prints, (ended, other)
        return Reference(template, before_files, after, digests, ended, case.prints, first)

    def _template(self, before):
        """Return a working folder in which these commands have run."""
        if before not in self.templates:
            if before:
                folder = self._copy(self._template(before[:-1]))
                ended = self._run(before[-1], folder)
                assert ended.code == 0, (before[-1], ended)
            else:
                folder = self._new_folder()
                (folder / RESULTS).mkdir(parents=True)
                for name, text in INPUTS.items():
                    (folder / name).write_text(text)
            self.templates[before] = folder
        return self.templates[before]

    def _new_folder(self):
        self.number += 1
        return self.folder / str(self.number)

    def _copy(self, template):
        work = self._new_folder()
        shutil.copytree(template, work)
        return work

    def _contents(self, folder, files):
        """Return the content of each file; equal files are read once."""
        keys = {name: (Path(name).suffix, digest) for name, digest in files.items()}
        for name, key in keys.items():
            if key not in self.contents:
                self.contents[key] = content_of(folder / name)
        return {name: self.contents[key] for name, key in keys.items()}

    def _judge(self, name, work, ended, optional="-"):
        reference = self.references[name]
        problems = list(message_problems(reference, ended, CASES[name].lines))
        files = files_of(work / RESULTS)
        contents = self._contents(work / RESULTS, files)
        # A report names a result that it could not read, and has the others.
        unread = ended.code != 0 and "cannot be read" in ended.stderr
        changing = CASES[name].names_unread if unread else "-"
        problems += file_problems(reference, files, contents, changing)
        problems += missing_pictures(work / RESULTS)
        if ended.code == 0:
            problems += unfinished(reference, contents, optional)
            if reference.prints and ended.stdout != reference.ended.stdout:
                problems.append("printed something else, but the exit code is 0")
        return problems

    def _repeat(self, name, work, *, removable):
        """Repeat a command without faults, and judge the folder. Equal folders are tried once."""
        contents = self._contents(work / RESULTS, files_of(work / RESULTS))
        key = name, json.dumps([removable, contents], sort_keys=True)
        if key not in self.repeated:
            ended = self._run(CASES[name].arguments, work)
            problems = self._judge(name, work, ended)
            if ended.code != 0:
                problems.append(f"exit code {ended.code}: {ended.stderr}")
            if removable:
                problems += [f"{name} is left" for name in partial_files(work / RESULTS)]
            self.repeated[key] = [f"repeated: {problem}" for problem in problems]
        return self.repeated[key]
