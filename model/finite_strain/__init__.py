"""Finite rotation and finite strain: Newton's method around the contact loop, in statics and in time."""
