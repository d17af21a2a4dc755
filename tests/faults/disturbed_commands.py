"""Commands that tests kill or starve, and exact comparisons of the files that they leave."""

import random
import shutil
import time
from dataclasses import dataclass

import pytest
import yaml
from faults.contents import Content, contents, files_of, missing_pictures, partial_files
from faults.judge import file_problems, unfinished
from support.configs import VISCO_ELASTIC, plain
from support.sweeping import run_sweep
from support.sweeps import plan_of

from rbstab.store.disk.lock import is_locked

SPIN = "initial.angular_velocity[0]"

Words = tuple[str, ...]


@dataclass(frozen=True)
class Case:
    """A command, and what is done in its folder before.

    Args:
        words: The command.
        before: Commands that have run in the folder. `other.yaml` has always run.
        first: A command that does the first part of the work; its files may be there as well.
        fake_members: Members of a sweep with made up numbers; only its shards are there.
    """

    words: Words
    before: tuple[Words, ...] = ()
    first: Words = ()
    fake_members: int = 0


def _report(suffix):
    """Return a report that replaces another report of the same name."""
    name = f"report.{suffix}"
    older = ("report", "results/older.h5", "-o", name, "-q")
    before = (("run", "--no-prove", "older.yaml", "-q"), older)
    return Case(("report", "results/other.h5", "-o", name, "-q"), before)


SWEEP = (
    "sweep",
    "--no-prove",
    "plan.yaml",
    "--engine",
    "scipy",
    "--shard-size",
    "4",
    "--threads",
    "3",
    "-q",
)

CASES = {
    "run": Case(("run", "--no-prove", "case.yaml", "-q")),
    # The run is stored before its proof is begun.
    "run --prove": Case(
        ("run", "case.yaml", "--prove", "-q"), first=("run", "--no-prove", "case.yaml", "-q")
    ),
    "run --force": Case(
        ("run", "--no-prove", "case.yaml", "--force", "-q"),
        (("run", "--no-prove", "case.yaml", "--set", "body.mass=50", "-q"),),
    ),
    "sweep": Case(SWEEP),
    "sweep after its parts": Case(
        ("sweep", "--no-prove", "results/fake/plan.yaml", "-o", "results", "-q"),
        fake_members=20_000,
    ),
    "html": _report("html"),
    "md": _report("md"),
    "pdf": _report("pdf"),
    "text": _report("txt"),
    "data": Case(("report", "results/other.h5", "--json", "-q")),
}


class Undisturbed:
    """A case, its folder before the command, and the files after a run that nothing disturbed.

    Args:
        name: The name of the case.
        server: Runs the commands.
        folder: An empty folder.
    """

    def __init__(self, name, server, folder):
        self.name, case = name, CASES[name]
        self.words = case.words
        self.template = folder / "template"
        self.template.mkdir()
        _write_inputs(self.template)
        for words in (("run", "--no-prove", "other.yaml", "-q"), *case.before):
            ended = server.run(self.template, *words)
            assert ended.code == 0, ended
        if case.fake_members:
            path = self.template / "results" / "fake"
            run_sweep(path, plan_of(case.fake_members), shard_size=1000)
            (path / "members.h5").unlink()
        self.before = files_of(self.template)
        self.first: dict[str, Content] = {}
        if case.first:
            begun = folder / "begun"
            self.copy_to(begun)
            ended = server.run(begun, *case.first)
            assert ended.code == 0, ended
            self.first = contents(begun)
        done = folder / "done"
        self.copy_to(done)
        ended = server.run(done, *case.words)
        assert (ended.code, partial_files(done)) == (0, []), ended
        self.seconds = ended.seconds
        self.after, self.digests = contents(done), files_of(done)
        new = [name for name, digest in self.digests.items() if digest != self.before.get(name)]
        self.size = sum((done / name).stat().st_size for name in new)
        """The bytes of the files that the command writes."""

    def copy_to(self, folder):
        """Make a folder in which the command can run."""
        shutil.copytree(self.template, folder)

    def generator(self, number):
        """Return the random numbers of a trial."""
        return random.Random(f"{self.name} {number}")  # noqa: S311 (seeded trials)

    def wait(self, command, rng, folder):
        """Wait until a random moment; half of them are close to a write.

        Args:
            command: Runs in the folder.
            rng: The random numbers of this trial.
            folder: The folder as this process sees it.
        """
        if rng.random() < 0.5:
            time.sleep(rng.uniform(0, self.seconds))
            return
        there = [path for path in folder.rglob("*") if path.is_dir()]
        new = [folder / "results/plan" / name for name in ("", "shards", "traces")]
        command.until_writing(folder, *there, *new, folder / "report_files")
        # Often some milliseconds.
        time.sleep(rng.choice((rng.uniform(0, 0.003), rng.random() ** 4 * self.seconds)))

    def problems(self, folder):
        """Return what is wrong with the files: each is an earlier or a right one; none is lost."""
        files, file_contents = files_of(folder), contents(folder)
        return [*file_problems(self, files, file_contents), *missing_pictures(folder)]

    def assert_done(self, folder, ended):
        """Assert that the command has succeeded, and left what it leaves if nothing happens."""
        assert ended.code == 0, ended
        ended.assert_no_debris()
        assert partial_files(folder) == []
        problems = [*self.problems(folder), *unfinished(self, contents(folder))]
        assert not problems, problems


def daily_and_long(counts):
    """Return cases of a command with its numbers of trials: some for every day, more in the long
    suite.

    Args:
        counts: By command, the ends of both ranges of numbers.
    """
    return [
        *(
            pytest.param(name, range(daily), marks=pytest.mark.slow)
            for name, (daily, _) in counts.items()
        ),
        *(
            pytest.param(name, range(*both), marks=pytest.mark.long)
            for name, both in counts.items()
        ),
    ]


class Trials:
    """Runs of one command in folders of their own, each disturbed at another random moment.

    Args:
        done: The command when nothing disturbs it.
        server: Runs it.
        folder: An empty folder.
    """

    def __init__(self, done, server, folder):
        self.done = done
        self.server = server
        self.folder = folder

    def start(self, number, *words):
        """Start the command, or another, in a new folder; return it and this trial's generator."""
        work = self.folder / str(number)
        self.done.copy_to(work)
        return self.server.start(work, *(words or self.done.words)), self.done.generator(number)

    def repeat(self, folder):
        """Check what the command has left, and repeat it."""
        problems = self.done.problems(folder)
        assert not problems, problems
        for lock in folder.rglob(".lock"):
            assert not is_locked(lock.parent)
        self.done.assert_done(folder, self.server.run(folder, *self.done.words))


def _write_inputs(folder):
    base = plain(VISCO_ELASTIC)
    base["body"]["inertia"] = [10.0, 8.0, 3.0]
    base["integration"] = {"duration": 0.2, "samples": 101, "rtol": 1e-8, "engine": "scipy"}
    for number, name in enumerate(("case", "other", "older")):
        base["title"] = name
        base["initial"]["angular_velocity"] = [16, 32, -16 + number]
        (folder / f"{name}.yaml").write_text(yaml.safe_dump(base))
    base["integration"] |= {"duration": 0.02, "samples": 51, "rtol": 1e-6}
    vary = {SPIN: {"linspace": [-40, 40, 60]}}
    plan = {"title": "Spins", "base": base, "vary": vary, "keep": "traces"}
    (folder / "plan.yaml").write_text(yaml.safe_dump(plan))
