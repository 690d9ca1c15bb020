"""ParaView itself reads what is written, and its scripts draw it; skipped where it is not installed."""

import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from forms import Elasticity, Isotropic, Support
from geometry import Body, MovingRoad, Plane, half_cylinder, rectangle
from model import BodyOnRoad, solve, write_road
from model.results.xdmf import Series

SCRIPTS = Path(__file__).parents[1] / "demos" / "paraview"
pytestmark = pytest.mark.skipif(
    not (shutil.which("pvpython") and shutil.which("Xvfb")),
    reason="pvpython and Xvfb are not there: on Debian, apt install paraview python3-paraview xvfb",
)


@pytest.fixture(scope="module")
def pvpython():
    """Run pvpython on a screen of its own."""
    with subprocess.Popen(
        ["Xvfb", "-displayfd", "1", "-noreset", "-screen", "0", "1280x1024x24"],
        stdout=subprocess.PIPE,
        text=True,
    ) as screen:
        display = f":{screen.stdout.readline().strip()}"

        def run(*arguments):
            environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
            done = subprocess.run(
                ["pvpython", *map(str, arguments)],
                env=environment | {"DISPLAY": display},
                capture_output=True,
                text=True,
            )
            assert done.returncode == 0, done.stdout + done.stderr
            return done.stdout

        yield run
        screen.kill()


@pytest.fixture(scope="module")
def pressed(tmp_path_factory):
    """A half cylinder on a plane, as BodyOnRoad writes it."""
    folder = tmp_path_factory.mktemp("pressed")
    body = Body.from_grid(half_cylinder(10.0))
    elasticity = Elasticity(body, Isotropic(210e3, 0.3))
    support = Support(body).fix_node(body.nearest_node((0.0, 10.0)), x=0.0)
    system = elasticity.system(elasticity.total_force("top", (0.0, -1e4)), support)
    contact = BodyOnRoad(system, "arc", Plane(), reach=3.0)
    solution = solve(contact.problem)
    contact.write(folder / "pressed.xdmf", solution)
    return folder / "pressed.xdmf", contact.pressure(solution).max()


ASK = """
import sys
from paraview import simple
reader = simple.XDMFReader(FileNames=[sys.argv[1]])
for time in reader.TimestepValues or [0.0]:
    reader.UpdatePipeline(time)
    print(time, reader.GetDataInformation().GetNumberOfPoints())
    for name, data in (*reader.PointData.items(), *reader.CellData.items()):
        print(name, data.GetNumberOfComponents(), *data.GetRange(0))
"""


def test_paraview_reads_body_and_road(pvpython, pressed, tmp_path):
    script = tmp_path / "ask.py"
    script.write_text(ASK)
    path, peak = pressed
    said = {line.split()[0]: line.split()[1:] for line in pvpython(script, path).splitlines()}
    for name in (
        "displacement",
        "contact_pressure",
        "contact_traction",
        "gap",
        "status",
        "stress",
        "von_mises",
    ):
        assert name in said
    assert float(said["contact_pressure"][2]) == pytest.approx(peak)
    assert [float(value) for value in said["status"][1:]] == [0.0, 1.0]
    road = {
        line.split()[0]: line.split()[1:]
        for line in pvpython(script, f"{path.parent}/pressed_road.xdmf").splitlines()
    }
    assert np.allclose([float(value) for value in road["height"][1:]], 0.0)


def has_colours(path):
    """Tell whether a picture is neither empty nor of one colour."""
    from matplotlib import image

    pixels = image.imread(path)[..., :3].reshape(-1, 3)
    return len(np.unique((pixels * 15).astype(int), axis=0)) > 20


def test_the_script_draws_a_result(pvpython, pressed, tmp_path):
    pvpython(SCRIPTS / "show_result.py", pressed[0], "--zoom", "5", "--picture", tmp_path / "out.png")
    assert has_colours(tmp_path / "out.png")


def test_the_script_plays_a_series_on_a_moving_road(pvpython, tmp_path):
    body = Body.from_grid(rectangle(3.0, 2.0, 6, 4))
    series, times = Series(tmp_path / "block.xdmf", body), [0.0, 0.5, 1.0]
    for time in times:
        field = {
            "displacement": 0.1 * time * body.coordinates,
            "contact_pressure": time * body.coordinates[:, 0],
        }
        series.write(time, field)
    write_road(tmp_path / "block_road.xdmf", MovingRoad(Plane(), (1.0, 0.0)), body.coordinates, times)
    pvpython(SCRIPTS / "show_result.py", tmp_path / "block.xdmf", "--frames", tmp_path / "film")
    frames = [(tmp_path / "film" / f"{number:04d}.png").read_bytes() for number in range(3)]
    assert len(set(frames)) == 3
    assert has_colours(tmp_path / "film" / "0002.png")
