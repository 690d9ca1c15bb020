"""The cases of demos/extreme_cases.py, family by family."""

from model.judge import Cases

CASES = Cases()
