"""The node loop: friction laws, block kernels, the contact sweep and its natural residual."""
