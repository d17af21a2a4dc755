"""Plans on the command line: the names of their sweeps, and their errors."""

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rbstab.config.errors import ConfigError


def sweep_name(path: Path) -> str:
    """Return the name of a plan's sweep: the stem of its file, or the name of its sweep folder."""
    return path.absolute().parent.name if is_in_sweep_folder(path) else path.stem


def is_in_sweep_folder(path: Path) -> bool:
    """Whether a plan is the copy in the folder of its sweep; this copy names its engine.

    Raises:
        OSError: The disk reports an error.
    """
    from rbstab.files.existence import is_file
    from rbstab.sweep.folder.manifest import MANIFEST
    from rbstab.sweep.folder.sweep_folder import PLAN_FILE

    return path.name == PLAN_FILE and is_file(path.parent / MANIFEST)


def plan_problem_lines(path: Path, error: "ConfigError") -> list[str]:
    """Return one line for each problem of a plan; a single line if the file is a config."""
    from rbstab.config.errors import ConfigError, ConfigProblem, Location
    from rbstab.files.shell_words import shell_word
    from rbstab.sweep.plan.load import is_config
    from rbstab_cli.arguments.configs import is_result_file, naming_example, result_problem

    if is_result_file(path):
        return [result_problem(path, "a plan")]
    with suppress(ConfigError):
        if is_config(path):
            expected = f"expected a plan with base and vary; run it: rbstab run {shell_word(path)}"
            return [str(ConfigProblem(Location(str(path)), "", "is a config", expected))]
    return [naming_example(path, str(problem)) for problem in error.problems]
