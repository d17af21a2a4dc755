"""Problems of a plan, each at its place in the file."""

from pydantic import ValidationError

from rbstab.config.errors import ConfigProblem
from rbstab.config.messages import problems_of
from rbstab.config.source import Path, Source
from rbstab.sweep.plan.plan_file import PlanFile, ReadablePlan


class Problems(list[ConfigProblem]):
    """The problems that are found in the source of a plan, those of its text first."""

    def __init__(self, source: Source) -> None:
        super().__init__(source.problems)
        self.source = source

    def add(self, path: Path, problem: str, expected: str, *, of_key: bool = False) -> None:
        """Add a problem at a value or, with `of_key`, at its key."""
        found = self.source.problem(path, problem, expected, of_key=of_key)
        self += self.source.new([found])

    def read(self) -> PlanFile:
        """Return what is right in the file, and add the problems of the rest."""
        data = self.source.data
        try:
            return PlanFile.model_validate(data)
        except ValidationError as error:
            self += self.source.new(problems_of(error, self.source, PlanFile))
            wrong = {one["loc"][: 2 if one["loc"][0] == "vary" else 1] for one in error.errors()}
        right = {key: value for key, value in data.items() if (key,) not in wrong}
        if isinstance(right.get("vary"), dict):
            right["vary"] = {k: v for k, v in data["vary"].items() if ("vary", k) not in wrong}
        return ReadablePlan.model_validate(right)
