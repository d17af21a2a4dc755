"""`rbstab cache`."""

from typing import Any

from rbstab_cli.options import declare, flag


@declare("cache", "rbstab cache --clear")
@flag("--clear", help="Remove all code from the cache.")
def command(**given: Any) -> None:
    """Show the cache of compiled code, or clear it.

    Sweeps and the engine heyoka compile the equations of a config once and keep the code, up to 200
    MB; then the code that was not used for the longest time is removed. It lies in the cache folder
    of the user, or in the folder that the variable HEYOKA_CACHE_DIR names. Results do not depend on
    it.
    """
    from rbstab_cli.work.cache import cache

    cache(**given)
