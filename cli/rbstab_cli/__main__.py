"""`python -m rbstab_cli` is `rbstab`."""

from rbstab_cli.main import main

main()
