"""Many scenes, in processes of their own, each outcome kept in a file as soon as it is known."""

import json
import multiprocessing
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

from .scenes import drawn
from .trial import tried


def outcome(number: int) -> dict[str, Any]:
    """Draw, solve and judge the scene of a number."""
    return tried(drawn(number))


def outcomes(
    numbers: Iterable[int],
    processes: int = 1,
    kept: Path | None = None,
    progress: Callable[[Iterable, str], Iterable] = lambda them, description: them,
) -> list[dict[str, Any]]:
    """Return the outcomes of scenes, by number; of those that are known if it is interrupted (Ctrl-C).

    Parameters
    ----------
    numbers : iterable of int
    processes : int
        How many at a time.
    kept : Path, optional
        A file of outcomes, a line each; those that it has are not computed again, the others are added.
    progress : callable
        Shows how far a loop has come.
    """
    found = {one["number"]: one for one in _read(kept)}
    wanted = list(numbers)
    missing = [number for number in wanted if number not in found]
    try:
        for one in progress(_Computed(missing, processes), "scenes") if missing else []:
            found[one["number"]] = one
            if kept is not None:
                with kept.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(one) + "\n")
    except KeyboardInterrupt:
        if not found:
            raise
        print(f"Interrupted after {len(found)} of {len(wanted)} scenes.")
    return [found[number] for number in wanted if number in found]


class _Computed:
    """The outcomes of some scenes, as they come."""

    def __init__(self, numbers: list[int], processes: int):
        self.numbers, self.processes = numbers, processes

    def __len__(self) -> int:
        return len(self.numbers)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        if self.processes == 1:
            yield from map(outcome, self.numbers)
            return
        with multiprocessing.get_context("spawn").Pool(self.processes) as pool:
            yield from pool.imap_unordered(outcome, self.numbers, chunksize=4)


def _read(kept: Path | None) -> list[dict[str, Any]]:
    """Outcomes of an earlier run; a last line that was cut off is left out."""
    if kept is None or not kept.exists():
        return []
    whole = [
        line for line in kept.read_text(encoding="utf-8").splitlines(keepends=True) if line.endswith("\n")
    ]
    kept.write_text("".join(whole), encoding="utf-8")
    return [json.loads(line) for line in whole]
