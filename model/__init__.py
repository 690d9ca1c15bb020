"""How it touches: the node loop, friction laws, corrections and closed forms."""
