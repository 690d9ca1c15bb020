"""3-D scenes as pages of their own: a pyvista plotter, and the vtk.js viewer that trame-vtk brings along."""

import io
import json
import zipfile
from pathlib import Path
from typing import Any

ICON = "https://kitware.github.io/vtk-js/icon/favicon-${t}x${t}.png"  # the viewer would fetch it


def write_page(plotter: Any, path: Path) -> None:
    """Write what a plotter shows as one HTML file that can be turned with the mouse and needs no server.

    `Plotter.export_html` would do the same through a trame server, parts of which load more from the network.
    """
    from trame_vtk.modules.vtk.serializers import (
        SynchronizationContext,
        extract_array_hash,
        initialize_serializers,
        reference_id,
        serialize,
    )
    from trame_vtk.tools.vtksz2html import write_html

    plotter.show(auto_close=False, jupyter_backend="none")
    initialize_serializers()
    context, window = SynchronizationContext(), plotter.render_window
    context.set_ignore_last_dependencies(True)
    scene = serialize(None, window, reference_id(window), context, 1)
    scene["extra"] = {
        "vtkRefId": reference_id(window),
        "centerOfRotation": plotter.camera.GetFocalPoint(),
        "camera": reference_id(plotter.camera),
    }
    hashes = {
        entry["hash"]: entry | {"content": context.get_cached_data_array(entry["hash"], False)}
        for entry in extract_array_hash(scene)
    }
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("index.json", json.dumps({"hashes": hashes, "scene": scene}))
    path.parent.mkdir(parents=True, exist_ok=True)
    page = io.StringIO()
    write_html(packed.getvalue(), page)
    path.write_text(page.getvalue().replace(ICON, "data:,"), encoding="utf-8")
