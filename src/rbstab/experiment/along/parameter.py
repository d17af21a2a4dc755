"""A parameter: a number of a config, or a factor on all numbers at a key, and values of it."""

from dataclasses import dataclass, replace

from rbstab.config.errors import ConfigError, Location, closest_keys, did_you_mean
from rbstab.config.load import with_numbers
from rbstab.config.numbers import changed_numbers, keys_of, numbers_below, unit_at, unit_problem
from rbstab.config.schema import Config
from rbstab.config.units import NumberKey, number_key
from rbstab.experiment.answers.threshold import NamedNumber, named_number
from rbstab.files.text import shortened
from rbstab.mechanics.numbers import Array


@dataclass(frozen=True, eq=False)
class Parameter:
    """A parameter of configs.

    Args:
        key: The key of its numbers, such as `controller.K_r`.
        values: Its values, shape (n,), in the unit of the key; or factors.
        scales: Whether it is a factor on all numbers at the key.
    """

    key: str
    values: Array
    scales: bool = True

    @property
    def read(self) -> NumberKey:
        """The key as a path, which no config has if it is not a key."""
        return number_key(self.key) or NumberKey((self.key,))

    def at(self, config: Config, value: float) -> Config:
        """Return a config with a value of the parameter.

        Raises:
            LookupError: There is no such key, or it holds no numbers.
            ConfigError: The changed config is not valid.
        """
        return with_numbers(config, changed_numbers(config, self.read, value, scale=self.scales))

    def named(self, config: Config) -> NamedNumber:
        """Return its number in a config with the unit of the key, of several one that is not 0."""
        number = named_number(config, self.read.path)
        return number._replace(
            unit=unit_at(config, self.key), value=number.value / self.read.factor
        )

    def check(self, config: Config) -> None:
        """Check that a config has this parameter; the error names the keys that were meant.

        Raises:
            ConfigError: There is no such key; it holds no numbers, only zeros that a factor does
                not change, or several that have no common value; or an end is not valid.
        """
        key = shortened(self.key)
        where = Location(f"--along {key}")
        try:
            numbers = dict(numbers_below(config, self.read.path))
        except LookupError as error:
            keys = [name for name in keys_of(config) if not name.startswith("initial.")]
            meant = did_you_mean(closest_keys(key.partition("[")[0], keys))
            expected = meant or f"expected one of {', '.join(keys)}"
            problem = f"{key} has no numbers that can be varied"
            raise ConfigError.at(where, problem, expected) from error
        wrong = unit_problem(config, self.read)
        if self.scales and not any(numbers.values()):
            wrong = "is 0, so no factor changes it", f"expected a config with {key} above 0"
        elif not self.scales and len(numbers) > 1:
            expected = f"expected factors, {key}=x0.5:x2:41, or one of them, {key}[0]=1:20:41"
            wrong = f"has {len(numbers)} numbers", expected
        if wrong is not None:
            raise ConfigError.at(where, f"{key} {wrong[0]}", wrong[1])
        try:
            for end in self.values[[0, -1]].tolist():
                self.at(config, end)
        except ConfigError as error:
            raise ConfigError(
                [replace(problem, location=where) for problem in error.problems]
            ) from error
