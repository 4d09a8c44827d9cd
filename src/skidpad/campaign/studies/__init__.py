"""Small experiments of their own, for findings that the matrix cannot decide."""
