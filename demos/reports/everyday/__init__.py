"""Everyday scenes drawn at random, and a judge that shares no code with the solvers."""
