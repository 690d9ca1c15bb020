"""The same problem shared by many ranks: exchange of shared nodes, matrices by rows, multigrid."""
