"""Where the families put their cases."""

from model.judge import Cases

CASES = Cases()
