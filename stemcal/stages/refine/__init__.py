"""The closed loop: simulate at the solution, compare, learn from it, go on until the force is right."""
