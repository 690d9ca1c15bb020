"""Pictures by ParaView itself, taken off screen from what the lessons have written, where ParaView is there."""

import os
import shutil
import subprocess
from pathlib import Path

SCRIPT = Path(__file__).parents[1] / "paraview" / "show_result.py"
PICTURES = {  # name: file below the folder of runs, options of the script
    "cylinder": (
        "section_3_1_1_normal_loading/results/section_3_1_1_normal_loading/friction.xdmf",
        ["--colour", "von_mises", "--zoom", "5"],
    ),
    "heel": ("first_lecture/heel.xdmf", ["--zoom", "1.5"]),
}


def take_pictures(runs: Path, folder: Path) -> list[str]:
    """Write NAME.png for each of `PICTURES` into a folder; return the names.

    Without pvpython and Xvfb (Debian: apt install paraview xvfb) none is taken, and those that are there stay.
    """
    if not (shutil.which("pvpython") and shutil.which("Xvfb")):
        return []
    # -noreset: without it the screen starts anew after each picture, and the next may come too early
    screen = subprocess.Popen(
        ["Xvfb", "-displayfd", "1", "-noreset", "-screen", "0", "1280x1024x24"],
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert screen.stdout is not None
        kept = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
        environment = kept | {"DISPLAY": f":{screen.stdout.readline().strip()}"}
        for name, (result, options) in PICTURES.items():
            command = ["pvpython", SCRIPT, runs / result, *options, "--picture", folder / f"{name}.png"]
            subprocess.run(list(map(str, command)), env=environment, check=True, capture_output=True)
    finally:
        screen.kill()
        screen.wait()
    return list(PICTURES)


if __name__ == "__main__":  # the pictures that are checked in
    import sys

    print(take_pictures(Path(sys.argv[1]), Path(__file__).parent / "_static" / "paraview"))
