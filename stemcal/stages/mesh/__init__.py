"""How much of the force at the solution is the mesh's: other places, other element sizes, and what that does to every
interval.
"""
