"""Maps of a sweep over two parameters, and curves along one."""
