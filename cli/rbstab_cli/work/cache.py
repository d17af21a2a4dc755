"""`rbstab cache`: the cache of compiled code."""

import click


def cache(clear: bool) -> None:
    """Print the size of the cache, or clear it."""
    try:
        from rbstab.integrate.heyoka.compile_cache import cache_size, clear_cache
    except ImportError as error:
        raise click.UsageError(f"the engine heyoka cannot be used here: {error}") from error
    usage = cache_size()
    if clear and usage is not None:
        clear_cache()
    if usage is None:
        click.echo(
            "No compiled code is kept: this version of heyoka cannot, or there is no cache folder "
            "(HEYOKA_CACHE_DIR names one)."
        )
        return
    size, limit = f"{usage.size / 1e6:.1f} MB", f"{usage.limit / 1e6:.0f} MB"
    click.echo(f"{usage.folder}: {f'removed {size}' if clear else f'{size} of at most {limit}'}")
