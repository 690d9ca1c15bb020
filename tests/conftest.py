"""What tests of demos share."""

import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest


@pytest.fixture(scope="module")
def quick(request, tmp_path_factory):
    """Run the demo that the test module calls DEMO, in its quick form: folder, summary, results' values."""
    demo = Path(__file__).parents[1] / "demos" / f"{request.module.DEMO}.py"
    folder = tmp_path_factory.mktemp("demo")
    subprocess.run([sys.executable, demo, "--quick", "--out", folder], check=True, cwd=folder, timeout=900)
    out = folder / demo.stem
    summary = json.loads((out / "summary.json").read_text())
    values = {key: result["value"] for key, result in summary["results"].items()}
    return SimpleNamespace(out=out, summary=summary, results=values)
