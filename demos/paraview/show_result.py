"""Show a result in ParaView: the body warped by its displacement, a field as colours, the road, and a series in motion.

    pvpython demos/paraview/show_result.py results/NAME/FILE.xdmf [--colour contact_pressure] [--scale 1]
             [--road ROAD.xdmf] [--zoom 4] [--picture OUT.png] [--frames FOLDER]

Without --picture and --frames a window opens and the series plays in it. In ParaView itself the same is done by
*View > Python Shell*: `import sys; sys.argv = ["", "results/NAME/FILE.xdmf"]; exec(open("demos/paraview/show_result.py").read())`.
"""

import argparse
import sys
from pathlib import Path

from paraview import simple

CELLS = ("von_mises", "stress")


def show_body(path, colour, scale):
    """Load a result, warp it, and colour it; return reader and picture of it."""
    reader = simple.XDMFReader(registrationName=path.stem, FileNames=[str(path)])
    reader.UpdatePipeline()
    points, cells = reader.PointData.keys(), reader.CellData.keys()
    if colour not in [*points, *cells]:
        raise SystemExit(f"{path} has no field {colour!r}; it has {', '.join([*points, *cells])}.")
    warped = simple.WarpByVector(Input=reader, Vectors=["POINTS", "displacement"], ScaleFactor=scale)
    display = simple.Show(warped)
    display.SetRepresentationType("Surface With Edges")
    display.EdgeColor = [0.6, 0.6, 0.6]
    simple.ColorBy(display, ("POINTS" if colour in points else "CELLS", colour))
    display.RescaleTransferFunctionToDataRangeOverTime() if len(reader.TimestepValues) > 1 else None
    table = simple.GetColorTransferFunction(colour)
    table.ApplyPreset("Viridis (matplotlib)", True)  # even in grey, and for those who see colours otherwise
    display.SetScalarBarVisibility(simple.GetActiveView(), True)
    return reader, display


def show_road(path):
    """Draw the road; where it moves, it is warped by how far it has moved."""
    road = simple.XDMFReader(registrationName=path.stem, FileNames=[str(path)])
    road.UpdatePipeline()
    if road.PointData.GetArray("displacement"):
        road = simple.WarpByVector(Input=road, Vectors=["POINTS", "displacement"])
    display = simple.Show(road)
    simple.ColorBy(display, None)
    display.AmbientColor = display.DiffuseColor = [0.35, 0.35, 0.35]
    display.LineWidth = 4.0


def look(view, reader, zoom):
    """Look along the plane's normal, or from the side in space, and as near as asked for."""
    low, high = (reader.GetDataInformation().GetBounds()[k::2] for k in (0, 1))
    simple.ResetCamera(view)
    if high[2] > low[2]:
        view.CameraPosition = [1.6 * (high[0] - low[0]), -3 * (high[1] - low[1]), 1.2 * (high[2] - low[2])]
        view.CameraViewUp = [0, 0, 1]
        simple.ResetCamera(view)
    elif zoom > 1:
        view.CameraFocalPoint = [(low[0] + high[0]) / 2, low[1] + (high[1] - low[1]) / (3 * zoom), 0]
        view.CameraPosition = [*view.CameraFocalPoint[:2], view.CameraPosition[2]]
    view.CameraParallelProjection = 1
    view.CameraParallelScale /= zoom


def main(arguments):
    """Show what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("result", type=Path)
    parser.add_argument("--colour", default="contact_pressure")
    parser.add_argument("--scale", type=float, default=1.0, help="of the displacement")
    parser.add_argument("--road", type=Path, help="default: FILE_road.xdmf or road.xdmf beside it, if there")
    parser.add_argument("--zoom", type=float, default=1.0, help="towards the lowest point of a plane body")
    parser.add_argument("--picture", type=Path, help="of the last step")
    parser.add_argument("--frames", type=Path, help="a picture a step, into this folder")
    options = parser.parse_args(arguments)

    view = simple.GetActiveViewOrCreate("RenderView")
    view.ViewSize = [1100, 800]
    view.UseColorPaletteForBackground = 0
    view.Background = [1.0, 1.0, 1.0]
    view.OrientationAxesVisibility = 0
    reader, _ = show_body(options.result, options.colour, options.scale)
    beside = [
        options.result.with_name(f"{options.result.stem}_road.xdmf"),
        options.result.with_name("road.xdmf"),
    ]
    road = options.road or next((path for path in beside if path.exists()), None)
    if road:
        show_road(road)
    bar = simple.GetScalarBar(simple.GetColorTransferFunction(options.colour), view)
    bar.TitleColor = bar.LabelColor = [0.0, 0.0, 0.0]
    bar.TitleFontSize = bar.LabelFontSize = 22
    bar.Orientation, bar.WindowLocation, bar.ScalarBarLength = "Horizontal", "Lower Center", 0.5
    scene = simple.GetAnimationScene()
    scene.UpdateAnimationUsingDataTimeSteps()
    scene.GoToLast()
    look(view, reader, options.zoom)
    simple.Render(view)
    if options.picture:
        simple.SaveScreenshot(str(options.picture), view)
    if options.frames:
        options.frames.mkdir(parents=True, exist_ok=True)
        for number, time in enumerate(reader.TimestepValues or [0.0]):
            scene.AnimationTime = view.ViewTime = time
            simple.Render(view)
            simple.SaveScreenshot(str(options.frames / f"{number:04d}.png"), view)
    if not (options.picture or options.frames):
        scene.GoToFirst()
        scene.Play()
        simple.Interact(view)


main(sys.argv[1:])
