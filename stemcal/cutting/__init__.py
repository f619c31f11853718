"""The virtual shear test: a hollow stem on two supports, a wedge that comes down across it, the force it meets.

The stem is along x, the blade's edge along y at mid-span, the blade moves down along −z.
"""

# Raised whenever a change makes the same test give another force, so that stored runs are not taken for new ones.
REVISION = 9
