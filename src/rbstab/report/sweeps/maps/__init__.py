"""Maps of a sweep over two of its parameters, and curves along one."""
