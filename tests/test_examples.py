"""Every example in a docstring runs and prints what it says."""

import doctest
import importlib
import inspect
import warnings
from pathlib import Path

import pytest

HOUSE = Path(__file__).parents[1]
FILES = sorted(file for package in ("geometry", "forms", "model") for file in (HOUSE / package).rglob("*.py"))
FILES.append(HOUSE / "checks.py")
WITH_EXAMPLES = [
    ".".join(f.relative_to(HOUSE).with_suffix("").parts) for f in FILES if ">>> " in f.read_text()
]
NEEDS_AN_INSTRUMENT = {"topography.py"}  # a file that only a library which is not required can read


@pytest.mark.parametrize("name", WITH_EXAMPLES)
def test_examples_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    module = importlib.import_module(name.removesuffix(".__init__"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        failed, tried = doctest.testmod(module, optionflags=doctest.NORMALIZE_WHITESPACE)
    assert not failed and (tried or Path(str(module.__file__)).name in NEEDS_AN_INSTRUMENT)


def test_no_example_is_skipped():
    skipped = {file.name for file in FILES if "doctest: +" + "SKIP" in file.read_text()}
    assert skipped <= NEEDS_AN_INSTRUMENT


@pytest.mark.parametrize("package", ["geometry", "forms", "model"])
def test_everything_public_has_an_example(package):
    module = importlib.import_module(package)
    public = {name: getattr(module, name) for name in module.__all__}
    things = {
        name: thing
        for name, thing in public.items()
        if inspect.isfunction(thing) or (inspect.isclass(thing) and not issubclass(thing, Exception))
    }
    assert things and not [name for name, thing in things.items() if ">>> " not in (thing.__doc__ or "")]
