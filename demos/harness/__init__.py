"""What the demos share: scene, verdicts, timing."""
