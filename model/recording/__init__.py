"""Runs in time: time loop, history, contact events, energy balance, checkpoints."""
