"""Write aside, then rename: nothing half-written takes the place of something good."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def write_aside(path: str | Path) -> Iterator[Path]:
    """Give a name beside `path` to write to, and rename it to `path` once all went well.

    Parameters
    ----------
    path : str or Path
        The file wanted; missing folders are made.

    Raises
    ------
    ValueError
        If the file cannot be written: a folder has its name, permissions, a full disk. What was there stays.

    Examples
    --------
    >>> with write_aside("results.txt") as aside:
    ...     written = aside.write_text("all or nothing")
    >>> Path("results.txt").read_text()
    'all or nothing'
    """
    path = Path(path)
    if path.is_dir():
        raise ValueError(f"{path} is a folder; give the name of a file to write.")
    aside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield aside
        os.replace(aside, path)
    except OSError as error:
        raise ValueError(f"{path} cannot be written: {error.strerror or error}.") from error
    finally:
        with suppress(OSError):  # where its folder is none, nothing was written
            aside.unlink(missing_ok=True)


def check_writable(path: str | Path) -> None:
    """See early that a file can be written, before long work.

    Parameters
    ----------
    path : str or Path
        The file wanted; missing folders are made.

    Raises
    ------
    ValueError
        As for `write_aside`.
    """
    with suppress(_Unwanted), write_aside(path) as aside:
        aside.touch()
        raise _Unwanted


class _Unwanted(Exception):
    """Leave `write_aside` without renaming."""
