"""The compiled engine; only this package imports heyoka."""

from rbstab.integrate.heyoka.compile_cache import set_cache_folder

# Before anything is compiled: heyoka's own limit is 20 GB.
set_cache_folder()
