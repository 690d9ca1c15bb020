"""Rigid obstacles: closest-point projection, profiles, surfaces, files of samples."""
