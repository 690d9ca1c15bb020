"""What moves: weak forms and their assembly into node-blocked arrays."""
