"""VTKHDF beside XDMF, written by VTK: one file for a whole series."""

from pathlib import Path

from checks import is_path


def write_vtkhdf(path: str | Path) -> Path:
    """Write what NAME.xdmf holds, all its time steps, to NAME.vtkhdf (for ParaView 5.12 or newer).

    Parameters
    ----------
    path : str or Path
        NAME.xdmf, as `write_xdmf`, `Series` or `write_road` made it.

    Returns
    -------
    Path
        NAME.vtkhdf

    Raises
    ------
    ValueError
        If there is no such XDMF file, or the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from geometry import Body, rectangle
    >>> from model.results.xdmf import write_xdmf
    >>> body = Body.from_grid(rectangle(3.0, 2.0, 5, 4))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_xdmf(f"{folder}/body.xdmf", body, {"displacement": body.coordinates})
    ...     write_vtkhdf(f"{folder}/body.xdmf").name
    'body.vtkhdf'
    """
    import pyvista
    from vtkmodules.vtkIOHDF import vtkHDFWriter

    from model.atomic_file import write_aside

    path = is_path(path)
    if path.suffix != ".xdmf" or not path.exists():
        raise ValueError(f"There is no XDMF file {path}; write the result first.")
    target = path.with_suffix(".vtkhdf")
    with write_aside(target) as aside:
        reader = pyvista.get_reader(str(path)).reader  # the writer does not keep it alive
        writer = vtkHDFWriter()
        writer.SetFileName(str(aside))
        writer.SetInputConnection(reader.GetOutputPort())
        writer.SetWriteAllTimeSteps(True)
        writer.SetChunkSize(1000)  # rows; the default of 25,000 leaves small files mostly empty
        if not writer.Write():
            raise OSError(f"VTK could not write {target}")
    return target
