"""What tests of demos share."""

import json
import os
import runpy
import sys
import warnings
from itertools import combinations
from pathlib import Path
from types import SimpleNamespace

import matplotlib
import numpy as np
import pytest
from harness.scene import Scene
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D

# For Open MPI, which refuses to run as root and more ranks than cores; MPICH takes both.
os.environ |= {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",
    "OMPI_MCA_btl_vader_single_copy_mechanism": "none",
}

DEMOS = Path(__file__).parents[1] / "demos"


def checked(figure):
    """Let each figure of a scene be looked at: lines of a legend are told apart in grey."""

    def look(scene, picture, name):
        for axes in picture.axes if picture else []:
            legend = axes.get_legend()
            lines = [each for each in (legend.get_lines() if legend else []) if isinstance(each, Line2D)]
            looks = [
                (
                    str(each._unscaled_dash_pattern),
                    each.get_linestyle() == "None",
                    each.get_marker(),
                    each.get_linewidth() // 2,
                )
                for each in lines
            ]
            greys = [float(np.dot([0.2126, 0.7152, 0.0722], to_rgb(each.get_color()))) for each in lines]
            for (one, grey), (other, shade) in combinations(zip(looks, greys), 2):
                assert one != other or abs(grey - shade) > 0.25, f"{name}: lines that look alike in grey"
        return figure(scene, picture, name)

    return look


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
        patch.setattr(Scene, "figure", checked(Scene.figure))
        names = runpy.run_path(str(demo), run_name=demo.stem)
    out = folder / demo.stem
    summary = json.loads((out / "summary.json").read_text())
    values = {key: result["value"] for key, result in summary["results"].items()}
    return SimpleNamespace(out=out, summary=summary, results=values, names=names)
