"""Closed-form solutions of contact mechanics."""
