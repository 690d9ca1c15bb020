"""The discrete contact problem and the rigid body modes of its bodies."""
