"""Where the families put their cases."""

from harness.verdict import Cases

CASES = Cases()
