"""Solvers of the discrete contact problem: corrections, convergence record and diagnosis."""
