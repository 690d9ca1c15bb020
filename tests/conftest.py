"""What tests of demos share."""

import json
import runpy
import sys
import warnings
from pathlib import Path
from types import SimpleNamespace

import matplotlib
import pytest

DEMOS = Path(__file__).parents[1] / "demos"


@pytest.fixture(scope="module")
def quick(request, tmp_path_factory):
    """Run the demo that the test module calls DEMO, in its quick form, in this process.

    Its folder, its summary, the values of its results, and its names.
    """
    demo = DEMOS / f"{request.module.DEMO}.py"
    folder = tmp_path_factory.mktemp("demo")
    matplotlib.use("agg")
    with pytest.MonkeyPatch.context() as patch, warnings.catch_warnings():
        patch.setattr(sys, "argv", [str(demo), "--quick", "--out", str(folder)])
        patch.setattr(sys, "path", [str(demo.parent), *sys.path])
        patch.chdir(folder)
        names = runpy.run_path(str(demo), run_name=demo.stem)
    out = folder / demo.stem
    summary = json.loads((out / "summary.json").read_text())
    values = {key: result["value"] for key, result in summary["results"].items()}
    return SimpleNamespace(out=out, summary=summary, results=values, names=names)
