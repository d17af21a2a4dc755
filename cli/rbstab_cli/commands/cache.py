"""`rbstab cache`."""

import click

from rbstab_cli import exit_codes


@click.command("cache")
@click.option("--clear", is_flag=True, help="Remove all code from the cache.")
def command(clear: bool) -> None:
    """Show the cache of compiled code, or clear it.

    Sweeps and the engine heyoka compile the equations of a config once and keep the code, up to 200
    MB; then the code that was not used for the longest time is removed. It lies in the cache folder
    of the user, or in the folder that the variable HEYOKA_CACHE_DIR names. Results do not depend on
    it.
    """
    try:
        from rbstab.integrate.heyoka.disk_cache import CacheError, cache_size, clear_cache
    except ImportError as error:
        raise click.UsageError(f"the engine heyoka cannot be used here: {error}") from error

    try:
        found = cache_size()
        if found is None:
            click.echo(
                "No compiled code is kept: this version of heyoka cannot, or there is no cache "
                "folder (HEYOKA_CACHE_DIR names one)."
            )
            return
        if clear:
            clear_cache()
            click.echo(f"{found.folder}: removed {found.size / 1e6:.1f} MB")
        else:
            size, limit = f"{found.size / 1e6:.1f} MB", f"{found.limit / 1e6:.0f} MB"
            click.echo(f"{found.folder}: {size} of at most {limit}")
    except CacheError as error:
        click.echo(f"error: {error}", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE) from error
