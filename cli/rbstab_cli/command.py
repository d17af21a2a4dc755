"""A command of `rbstab`: which of its words it refuses, and how it ends."""

from collections import Counter
from collections.abc import Mapping
from typing import Any

import click
from click.core import ParameterSource

from rbstab_cli.errors import told

SET = "--set"

TYPED = "rbstab.typed"
"""The key of the words of a command, as they were typed, in `Context.meta`."""

Rules = Mapping[str, tuple[str, ...]]
"""Options and arguments by an option, as they are typed: `{"--part": ("--force",)}`."""


class Command(click.Command):
    """A command whose function may return its exit code, and raise the errors of the library.

    Args:
        needs: Options that have no effect without another one.
        excludes: Options with those that cannot be given beside them.
        alone: Options with all that can be given beside them.
    """

    def __init__(
        self,
        *arguments: Any,
        needs: Mapping[str, str] | None = None,
        excludes: Rules | None = None,
        alone: Rules | None = None,
        **attributes: Any,
    ) -> None:
        super().__init__(*arguments, **attributes)
        self.needs, self.excludes, self.alone = needs or {}, excludes or {}, alone or {}

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the words of the command; refuse those that would have no effect.

        One is an option with one value that is given twice. Flags may be repeated: that changes
        nothing.

        Raises:
            UsageError: There is such a word, or one that click refuses.
        """
        ctx.meta[TYPED] = tuple(args)
        try:
            _, _, given = self.make_parser(ctx).parse_args(list(args))
        except click.NoSuchOption as error:
            _refuse_key(error.option_name, self, ctx)
            raise
        for option, count in Counter(filter(_takes_single_value, given)).items():
            if count > 1:
                ctx.fail(
                    f"{max(option.opts, key=len)} is given {count} times, and takes one value."
                )
        left = super().parse_args(ctx, args)
        if not ctx.resilient_parsing:
            self._refuse_together(ctx)
        return left

    def _refuse_together(self, ctx: click.Context) -> None:
        """Refuse options that need or exclude others."""
        given = [_typed(parameter, ctx) for parameter in self.params if _is_given(parameter, ctx)]
        for option in given:
            needed = self.needs.get(option)
            if needed is not None and needed not in given:
                ctx.fail(f"{option} has no effect without {needed}")
            beside = {option, *self.alone.get(option, given)}
            others = self.excludes.get(option, ())
            refused = [other for other in given if other in others or other not in beside]
            if refused:
                ctx.fail(f"{option} cannot be combined with {', '.join(refused)}")

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; end it with its exit code."""
        try:
            code = super().invoke(ctx)
        except (click.ClickException, click.exceptions.Exit, click.Abort):
            raise
        except Exception as error:
            failed = told(error)
            if failed is None:
                raise
            raise failed from error
        if code:
            ctx.exit(code)


def _takes_single_value(parameter: click.Parameter) -> bool:
    return isinstance(parameter, click.Option) and not (
        parameter.multiple or parameter.is_flag or parameter.count
    )


def _is_given(parameter: click.Parameter, ctx: click.Context) -> bool:
    return ctx.get_parameter_source(str(parameter.name)) is ParameterSource.COMMANDLINE


def _typed(parameter: click.Parameter, ctx: click.Context) -> str:
    """Return a parameter that is given as it is typed: `--no-prove`, or an argument as PLAN."""
    if not isinstance(parameter, click.Option):
        return parameter.make_metavar(ctx).strip("[].")
    off = parameter.secondary_opts and not ctx.params[str(parameter.name)]
    return (parameter.secondary_opts if off else parameter.opts)[0]


def _refuse_key(unknown: str, command: click.Command, ctx: click.Context) -> None:
    """Say how a key is changed whose name is used as an option: `--duration`."""
    if not unknown.startswith("--") or not any(
        SET in parameter.opts for parameter in command.params
    ):
        return
    # Imported late: the schema takes a while.
    from rbstab.config.errors import keys_named
    from rbstab.config.model_keys import keys_of_variants

    keys = keys_named(unknown.lstrip("-"), keys_of_variants())
    if keys:
        ways = " or ".join(f"{SET} {key}=VALUE" for key in keys)
        ctx.fail(f"No such option '{unknown}'. Change the config: {ways}")
