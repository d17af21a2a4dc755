"""The type of options that take one of some words."""

from typing import Any

import click


class Choice(click.Choice[str]):
    """`click.Choice` whose message says which word was likely meant."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the word.

        Raises:
            BadParameter: It is none of the words.
        """
        try:
            return super().convert(value, param, ctx)
        except click.BadParameter as error:
            from rbstab.config.errors import closest

            close = closest(str(value), self.choices)
            if close is None:
                raise
            message = f"{error.message} Did you mean {close}?"
            raise click.BadParameter(message, ctx, param) from error
