"""The README's example runs as it stands and prints what the README says."""

import os
import re
import subprocess
import sys
from pathlib import Path

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")


def test_the_example_prints_what_it_should(tmp_path):
    (code,) = re.findall(r"```python\n(.*?)```", README, re.S)
    first, last = re.search(r"It prints `(.*?)`.*?end with `(.*?)`", README, re.S).groups()
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[1])}
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    lines = done.stdout.splitlines()
    assert (lines[0], len(lines), lines[-1]) == (first, 11, last)
    assert (tmp_path / "cylinder.xdmf").exists()
    assert (tmp_path / "cylinder_in_time.xdmf").read_text(encoding="utf-8").count("<Time") == 20


def test_every_command_named_exists():
    root = Path(__file__).parents[1]
    for script in set(re.findall(r"demos/([\w/]+\.py)", README)):
        assert (root / "demos" / script).exists(), script
