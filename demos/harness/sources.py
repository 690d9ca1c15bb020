"""Code of the harness, shown where a lesson explains it."""

import inspect
from collections.abc import Callable


def show_source(*functions: Callable) -> None:
    """Show the source of functions: in colour in a notebook, printed elsewhere.

    >>> def half(x):
    ...     return x / 2
    >>> show_source(half)
    def half(x):
        return x / 2
    """
    text = "\n\n".join(inspect.getsource(getattr(each, "py_func", each)).rstrip() for each in functions)
    try:
        from IPython import get_ipython
        from IPython.display import Code, display
    except ImportError:
        print(text)
        return
    display(Code(text, language="python")) if get_ipython() else print(text)
