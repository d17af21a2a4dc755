"""Functions of the lengths of lines as parts of an energy, in balls."""
