"""Disturb commands: a script that reads series of faults from stdin, and answers on stdout.

The script imports everything once. Each command then runs in a fork of this process, from the entry
point of `rbstab` to its exit code; that is much faster than a new process. Run the script with
`python -m faults.library.trials FOLDER`, and with the variables of `control.build`.
"""

import json
import os
import shutil
import sys
from collections.abc import Iterable, Iterator
from itertools import count
from pathlib import Path
from typing import Any

from faults.library.cases import CASES, INPUTS, Case
from faults.library.contents import VOLATILE, Content, Folder, differences, equal, files_of
from faults.library.control import CONTROL, SHORT, Control, Fault
from faults.library.forks import (
    Ended,
    RunHere,
    import_all,
    read_contents,
    remember_pictures,
    run,
    run_to_end,
)
from faults.library.judge import (
    Reference,
    file_problems,
    message_problems,
    missing_pictures,
    new_lines,
    partial_files,
    unfinished,
)

RESULTS = "results"
"""The disturbed folder, in the working folder of a command."""


class Trials:
    """Disturbed commands in a folder.

    Args:
        folder: An empty folder.
        control: The control of the library.
    """

    def __init__(self, folder: Path, control: Control) -> None:
        self.folder = folder
        self.control = control
        self.templates: dict[tuple[str, ...], Path] = {}
        self.references: dict[str, Reference] = {}
        self.contents: dict[tuple[str, str], Content] = {}
        self.repeated: dict[tuple[str, str], list[str]] = {}
        self.number = 0

    def series(self, name: str, fault: Fault, sample: int | None) -> Iterator[dict[str, Any]]:
        """Disturb a command at its first call, its second, ... until it meets no fault.

        Args:
            name: The name of the case.
            fault: The fault; its `nth` is replaced.
            sample: The number of calls to disturb, evenly spaced; default all.
        """
        numbers: Iterable[int] = count(1)
        if sample is not None:
            calls = self.trial(name, fault._replace(nth=0))["calls"]
            steps = max(1, sample - 1)
            numbers = sorted({1 + (calls - 1) * k // steps for k in range(sample)} - {0})
        for nth in numbers:
            found = self.trial(name, fault._replace(nth=nth))
            if found["faults"] == 0 and sample is None:
                # The command made fewer calls; this was one more undisturbed run.
                if found["code"] != 0 or found["problems"]:
                    yield found
                return
            yield found

    def trial(self, name: str, fault: Fault) -> dict[str, Any]:
        """Run a command with a fault, judge what it left, and repeat it without the fault."""
        case, reference = CASES[name], self.reference(name)
        work = self._copy(reference.template)
        self.control.arm(work / RESULTS, fault)
        ended = run(case.arguments, work)
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
            problems += partial_files(files_of(work / RESULTS))
        problems += self._repeat(name, work, removable=removable)
        shutil.rmtree(work)
        return {
            "case": name,
            "fault": str(fault),
            **counts._asdict(),
            "first": counts.first.replace(str(work.resolve()), ""),
            "code": ended.code,
            "stderr": ended.stderr,
            "problems": problems,
        }

    def reference(self, name: str) -> Reference:
        """Return the undisturbed run of a case; it is made at the first call."""
        if name not in self.references:
            self.references[name] = self._make_reference(CASES[name])
        return self.references[name]

    def _make_reference(self, case: Case) -> Reference:
        template = self._template(case.before)
        runs = []
        for _ in range(2):
            work = self._copy(template)
            ended = run(case.arguments, work)
            assert ended.code == 0, (case, ended)
            digests = files_of(work / RESULTS)
            assert not list(partial_files(digests)), digests
            contents = self._contents(work / RESULTS, digests)
            runs.append((ended, digests, contents))
            shutil.rmtree(work)
        (ended, digests, after), (other, _, again) = runs
        for name, content in after.items():
            assert equal(content, again[name]), (name, differences(content, again[name]))
        before_files = files_of(template / RESULTS)
        assert ended.stdout == other.stdout or not case.prints, (ended, other)
        return Reference(template, before_files, after, digests, ended, case.prints)

    def _template(self, before: tuple[str, ...]) -> Path:
        """Return a working folder in which these commands have run."""
        if before not in self.templates:
            if before:
                folder = self._copy(self._template(before[:-1]))
                ended = run(before[-1], folder)
                assert ended.code == 0, (before[-1], ended)
            else:
                folder = self._new_folder()
                (folder / RESULTS).mkdir(parents=True)
                for name, text in INPUTS.items():
                    (folder / name).write_text(text)
            self.templates[before] = folder
        return self.templates[before]

    def _new_folder(self) -> Path:
        self.number += 1
        return self.folder / str(self.number)

    def _copy(self, template: Path) -> Path:
        work = self._new_folder()
        shutil.copytree(template, work)
        return work

    def _contents(self, folder: Path, files: Folder) -> dict[str, Content]:
        """Return the content of each file; another process reads the new ones."""
        new = [name for name in files if (Path(name).suffix, files[name]) not in self.contents]
        if new:
            for name, content in zip(new, read_contents(folder, new), strict=True):
                self.contents[Path(name).suffix, files[name]] = content
        return {name: self.contents[Path(name).suffix, digest] for name, digest in files.items()}

    def _judge(self, name: str, work: Path, ended: Ended, optional: str = "-") -> list[str]:
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

    def _repeat(self, name: str, work: Path, *, removable: bool) -> list[str]:
        """Repeat a command without faults, and judge the folder. Equal folders are tried once."""
        contents = self._contents(work / RESULTS, files_of(work / RESULTS))
        state = {
            file: sorted(item for item in content.items() if item[0] not in VOLATILE)
            for file, content in contents.items()
        }
        key = name, json.dumps([removable, state], sort_keys=True)
        if key not in self.repeated:
            ended = run(CASES[name].arguments, work)
            problems = self._judge(name, work, ended)
            if ended.code != 0:
                problems.append(f"exit code {ended.code}: {ended.stderr}")
            if removable:
                problems += partial_files(files_of(work / RESULTS))
            self.repeated[key] = [f"repeated: {problem}" for problem in problems]
        return self.repeated[key]


def serve(requests, answers, folder):
    """Answer requests, each a line of JSON: a case, a fault, and the size of the sample."""
    trials = Trials(folder, Control(Path(os.environ[CONTROL])))
    for line in requests:
        request = json.loads(line)
        fault = Fault(request["operation"], request["error"], 0, request["lasting"])
        found = list(trials.series(request["case"], fault, request["sample"]))
        answers.write(json.dumps(found) + "\n")
        answers.flush()


def main():
    """Serve; in a fork, run the command as `rbstab` does."""
    import_all()
    pictures = Path(sys.argv[1]) / "pictures"
    pictures.mkdir()
    remember_pictures(pictures)
    arguments: list[str] = []
    try:
        serve(sys.stdin, os.fdopen(os.dup(1), "w"), Path(sys.argv[1]))
    except RunHere as request:
        arguments = request.arguments
    if arguments:
        run_to_end(arguments)


if __name__ == "__main__":
    main()
