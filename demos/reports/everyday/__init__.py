"""Everyday scenes drawn at random, and a judge that shares no code with the solvers."""

from .run import outcomes

__all__ = ["outcomes"]
