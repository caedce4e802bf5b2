"""The solver against other solvers, references and extremes."""
