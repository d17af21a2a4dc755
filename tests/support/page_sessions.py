"""Runs what the pages of the documentation show, and compares what they print.

A page is a session in an empty folder, with a link `configs` unless the page says how to begin
(`FROM_NOTHING`). Its blocks run in order:

- `console`: lines after `$ ` are commands, the lines below are what they print. `...` stands for
  any lines. A command without output on the page must succeed.
- `text` directly below a `console` block: consecutive lines of what its last command prints.
- `python`: runs; names stay for later blocks. `pycon`: runs, with what it prints.
- `yaml` whose first line is a comment with a file name: is saved under this name.

`make docs-outputs` writes new outputs into the pages.
"""

import contextlib
import doctest
import io
import itertools
import re
import shlex
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from click.testing import CliRunner

import rbstab
from rbstab_cli.main import cli
from support.printed_lines import agrees, contains, lines_of

ROOT = Path(__file__).parents[2]
OPENING = re.compile(r"^```(console|python|pycon|text|yaml|bash)[^\n]*$")
FILE_NAME = re.compile(r"# ([\w/]+\.yaml)\b")
SHELL = ("cat", "cp", "head", "ls", "mkdir")
"""Programs that pages may run beside rbstab."""

FROM_NOTHING = (
    "docs/choosing.md",
    "docs/inputs.md",
    "docs/own_elements.md",
    "docs/tutorial_first.md",
    "docs/tutorial_limb.md",
    "docs/tutorial_limits.md",
    "docs/tutorial_python.md",
    "docs/tutorial_stable.md",
    "docs/tutorial_sweep.md",
)
"""Pages that a reader follows in an empty folder, not in a copy of the repository."""

PREPARED: dict[str, tuple[str, ...]] = {
    "docs/elements.md": (
        "cp configs/paper/case1_permanent.yaml my_config.yaml",
        "rbstab run configs/examples/elements.yaml -q --no-prove",
    ),
    "docs/reports.md": (
        "rbstab run configs/paper/case1_permanent.yaml -q --no-prove",
        "rbstab run configs/paper/case3_embedded.yaml -q --no-prove",
        "rbstab sweep stand_in/stability_map_visco_elastic.yaml -q",
    ),
    "docs/sweeps.md": (
        "cp stand_in/stability_map_visco_elastic.yaml plan.yaml",
        "rbstab sweep plan.yaml -q",
    ),
    "results/README.md": (
        "rbstab run configs/paper/case1_permanent.yaml -q --no-prove",
        "rbstab sweep stand_in/PLAN.yaml -q",
        "rbstab export results/PLAN -o sweep.nc",
    ),
}
"""What a reader of a page has done before. The folder `stand_in` has small plans (`STAND_INS`)."""

NOT_EXECUTED: dict[str, dict[str, str]] = {
    "*": {"pip install": "changes the environment"},
    "README.md": {"make": "installs an environment, and takes minutes"},
    "docs/cluster.md": {
        "rbstab sweep PLAN.yaml": "tests/sweep run parts and Dask clusters",
        "job=$(sbatch": "needs Slurm",
        "sbatch": "needs Slurm",
        "dask": "starts servers that do not end",
        "from dask_jobqueue": "needs Slurm",
        "from pathlib": "needs a Dask cluster; tests/sweep run the same calls",
        "#!/bin/bash": "needs Slurm",
        "export": "sets a variable of the shell",
    },
    "docs/reports.md": {
        "rbstab run configs/paper/*.yaml configs/examples/stability": "its exit code is 3",
        "rbstab report results/*.h5": "needs those results",
    },
    "docs/performance.md": {"rbstab sweep p.yaml": "a measurement of minutes"},
}
"""What is not run, by page (`*`: any): the beginning of a command or of a block, and the reason."""


class Block(NamedTuple):
    """A fenced block of a page: its language, its lines, and the index of its first line."""

    language: str
    lines: list[str]
    start: int


class Command(NamedTuple):
    """A command of a page, what the page shows of its output, and the index of its first line."""

    words: str
    shown: list[str]
    start: int


class Difference(NamedTuple):
    """What a page shows, from a line on, and what was printed instead."""

    start: int
    shown: list[str]
    printed: list[str]
    excerpt: bool = False


@dataclass
class Session:
    """A page that runs in a folder."""

    page: str
    folder: Path
    names: dict[str, Any] = field(default_factory=lambda: {"rbstab": rbstab})
    printed: list[str] = field(default_factory=list)
    differences: list[Difference] = field(default_factory=list)

    def run(self, text):
        """Run all blocks of a page, and return the outputs that differ."""
        prepare(self.folder, with_configs=self.page not in FROM_NOTHING)
        with contextlib.chdir(self.folder):
            for command in PREPARED.get(self.page, ()):
                code, output = execute(command)
                assert code == 0, f"{command}: {output}"
            previous = None
            for block in blocks(text):
                if block.language == "console" or not skipped(self.page, block.lines[0]):
                    self._run(block, previous)
                previous = block
        return self.differences

    def _run(self, block, previous):
        if block.language == "console":
            self._run_console(block)
        elif block.language == "python":
            code = compile("\n".join(block.lines), f"{self.page}:{block.start + 1}", "exec")
            with contextlib.redirect_stdout(io.StringIO()):
                exec(code, self.names)  # noqa: S102 it is our own page
        elif block.language == "pycon":
            self._run_prompts(block)
        elif block.language == "yaml" and (name := FILE_NAME.match(block.lines[0])):
            path = Path(name[1])
            path.parent.mkdir(exist_ok=True)
            path.write_text("\n".join([*block.lines, ""]), encoding="utf-8")
        elif block.language == "text" and previous is not None:
            self._find_excerpt(block, previous)

    def _find_excerpt(self, block, previous):
        if previous.language == "console" and not contains(self.printed, block.lines):
            self.differences.append(Difference(block.start, block.lines, self.printed, True))

    def _run_console(self, block):
        for command in commands(block):
            if skipped(self.page, command.words):
                continue
            code, output = execute(command.words)
            self.printed = lines_of(output)
            if command.shown:
                self._compare(command.start, command.shown, self.printed)
            else:
                assert code == 0, f"{self.page}: {command.words}: {output}"

    def _run_prompts(self, block):
        for example in doctest.DocTestParser().get_examples("\n".join([*block.lines, ""])):
            with contextlib.redirect_stdout(io.StringIO()) as output:
                exec(compile(example.source, self.page, "single"), self.names)  # noqa: S102
            first = block.start + example.lineno + example.source.count("\n")
            self._compare(first, lines_of(example.want), lines_of(output.getvalue()))

    def _compare(self, start, shown, printed):
        if not agrees(shown, printed):
            self.differences.append(Difference(start, shown, printed))


def prepare(folder, *, with_configs):
    """Fill an empty folder: the configs of the repository, and small plans with known names."""
    if with_configs:
        (folder / "configs").symlink_to(ROOT / "configs")
    (folder / "stand_in").mkdir()
    for name, text in STAND_INS.items():
        (folder / "stand_in" / name).write_text(text, encoding="utf-8")


_PLAN = """\
title: A small map
base: {base}
vary:
  initial.angular_velocity[0]: {{linspace: [-20, 20, 7]}}
  initial.angular_velocity[1]: {{linspace: [-20, 20, 7]}}
keep: traces
"""
STAND_INS = {
    name: _PLAN.format(base=ROOT / "configs/paper/case2_visco_elastic.yaml")
    for name in ("stability_map_visco_elastic.yaml", "PLAN.yaml")
}


def skipped(page, text):
    """Return whether a command or a block is one of those that are not executed."""
    exceptions = NOT_EXECUTED["*"] | NOT_EXECUTED.get(page, {})
    return text.removeprefix("$ ").startswith(tuple(exceptions))


def blocks(text):
    """Return the blocks of a page that are programs or outputs."""
    parsed, lines = [], iter(enumerate(text.splitlines()))
    for number, line in lines:
        if opening := OPENING.match(line):
            inner = itertools.takewhile(lambda pair: not pair[1].startswith("```"), lines)
            parsed.append(Block(opening[1], [content for _, content in inner], number + 1))
    return parsed


def commands(block):
    """Yield the commands of a `console` block with what the page shows of their output."""
    starts = [n for n, line in enumerate(block.lines) if line.startswith("$ ")]
    for start, end in itertools.pairwise([*starts, len(block.lines)]):
        words, first = block.lines[start][2:], start + 1
        while words.endswith("\\"):
            words, first = words[:-1] + block.lines[first].strip(), first + 1
        yield Command(words, block.lines[first:end], block.start + first)


def execute(command):
    """Run a command in the working folder; return its exit code and what it prints."""
    words = shlex.split(command)
    if words[0] in SHELL:
        done = subprocess.run(
            ["bash", "-c", command], capture_output=True, text=True, check=False, timeout=60
        )
        return done.returncode, done.stdout + done.stderr
    assert Path(words[0]).name == "rbstab", f"nobody knows how to run: {command}"
    words, target = (words[1:-2], words[-1]) if ">" in words else (words[1:], None)
    expanded = [sorted(str(path) for path in Path().glob(w)) if "*" in w else [w] for w in words]
    ran = CliRunner().invoke(cli, list(itertools.chain(*expanded)), prog_name="rbstab")
    if ran.exception is not None and not isinstance(ran.exception, SystemExit):
        raise ran.exception
    if target is None:
        return ran.exit_code, ran.output
    Path(target).write_text(ran.stdout, encoding="utf-8")
    return ran.exit_code, ran.stderr


def rewritten(text, differences):
    """Return a page with new outputs in place of those that differ."""
    lines = text.splitlines()
    for difference in reversed(differences):
        shown, printed = difference.shown, difference.printed
        if difference.excerpt or shown.count("...") > 1:
            continue
        while shown and not shown[-1]:
            shown = shown[:-1]
        if "..." in shown:
            head = shown.index("...")
            tail = len(shown) - head - 1
            printed = [*printed[:head], "...", *printed[len(printed) - tail :]]
        lines[difference.start : difference.start + len(shown)] = printed
    return "\n".join(lines) + "\n"


def pages():
    """Return the pages of the documentation, relative to the repository."""
    paths = [*ROOT.glob("docs/*.md"), ROOT / "README.md", ROOT / "results/README.md"]
    return sorted(path.relative_to(ROOT).as_posix() for path in paths)


def differences_of(page, folder):
    """Run a page in an empty folder."""
    return Session(page, folder).run((ROOT / page).read_text(encoding="utf-8"))


def main(names):
    """Write new outputs into pages; say which outputs need a hand."""
    by_hand = 0
    for page in names or pages():
        path = ROOT / page
        with tempfile.TemporaryDirectory() as folder:
            differences = differences_of(page, Path(folder))
        text = path.read_text(encoding="utf-8")
        path.write_text(rewritten(text, differences), encoding="utf-8")
        for difference in differences:
            left = difference.excerpt or difference.shown.count("...") > 1
            by_hand += left
            verb = "change by hand" if left else "written"
            sys.stdout.write(f"{page}:{difference.start + 1}: {verb}\n")
    return 1 if by_hand else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
