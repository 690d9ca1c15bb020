"""Figures of contact problems and of bodies in motion."""
