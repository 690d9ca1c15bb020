"""What a first run says: that the loop is being compiled, once, and only if it is."""

import subprocess
import sys

from numba import njit
from numba.core import event

from model.solvers.compiling import Announcement


def compiled(module):
    def double(x):
        return 2.0 * x

    double.__module__ = module
    return njit(double)(1.0)


def test_it_is_said_once_and_only_of_the_loop(capsys):
    with event.install_listener("numba:compile", Announcement()):
        compiled("somewhere.else")
        assert capsys.readouterr().err == ""
        compiled("model.node_loop.contact_sweep")
        said = capsys.readouterr()
        assert said.err.startswith("Compiling the contact loop, once") and said.out == ""
        compiled("model.solvers.semismooth_newton")
        assert capsys.readouterr().err == ""


def test_importing_listens_to_nothing():
    code = "import model; from numba.core import event; print(len(event._registered['numba:compile']))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "0"
