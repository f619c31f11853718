"""The virtual shear test: a stem on its supports is cut by a wedge-shaped blade, and the force is recorded.

The stem is along x, the blade's edge along y in the plane x = 0; the blade moves down along −z.
"""

# Incremented by every change that alters the force of a test, so that stored runs are not reused after it.
REVISION = 14
