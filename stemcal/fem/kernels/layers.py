"""The material of each block: one isotropic material of the whole body, or a table of several materials.

A body of one isotropic material uses `MaterialNumbers` and the kernels of `plasticity`. With layers or fibres the whole
body uses a `LayerTable` and the kernels of `fibres`, which include isotropic layers as a special case; these are
compiled when a study first needs them.
"""

from typing import Any, NamedTuple

from numba.extending import overload

from stemcal.arrays import Floats
from stemcal.fem.kernels.compile import TWO, inlined
from stemcal.fem.kernels.fibres import TransverseNumbers, transverse_return, unit
from stemcal.fem.kernels.plasticity import elastic_trial, radial_return

_overload: Any = overload  # numba's annotations of overload lack some options
_INLINED = {"forceinline": True, "error_model": "numpy", "fastmath": {"contract", "nsz"}}


class LayerTable(NamedTuple):
    """Materials of a body: a table with a column per field of `TransverseNumbers`, and the row of each block in it."""

    rows: Any  # (B,) int32
    table: Any  # (materials, columns)


def of_block(material: Any, b: int) -> Any:
    """Return the constants of the material of block b; in kernels, numba compiles `_of_block` for this function."""
    raise NotImplementedError


@_overload(of_block, jit_options=_INLINED)
def _of_block(material: Any, b: Any) -> Any:
    def same(material: Any, b: Any) -> Any:
        return material

    def listed(material: Any, b: Any) -> Any:
        m = material.table[material.rows[b]]
        return TransverseNumbers(
            m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8], m[9], m[10],
            m[11], m[12], m[13], m[14], m[15], m[16], m[17], m[18], m[19], m[20],
        )  # fmt: skip

    return listed if material.instance_class is LayerTable else same


def of_blocks(material: Any, first: int, behind: int) -> Any:
    """Return the materials of the blocks from `first` to the one before `behind`."""
    raise NotImplementedError


@_overload(of_blocks, jit_options=_INLINED)
def _of_blocks(material: Any, first: Any, behind: Any) -> Any:
    def same(material: Any, first: Any, behind: Any) -> Any:
        return material

    def listed(material: Any, first: Any, behind: Any) -> Any:
        return LayerTable(material.rows[first:behind], material.table)

    return listed if material.instance_class is LayerTable else same


def stress_after(old: Any, back: Any, de: Any, strain: Any, factor: Any, edge: Any, material: Any) -> Any:
    """Return stress, back stress, plastic strain, trial q and static yield stress after a strain increment.

    `edge` is the element's edge ζ, the axis of a transversely isotropic material.
    """
    raise NotImplementedError


@_overload(stress_after, jit_options=_INLINED)
def _stress_after(old: Any, back: Any, de: Any, strain: Any, factor: Any, edge: Any, material: Any) -> Any:
    def isotropic(old: Any, back: Any, de: Any, strain: Any, factor: Any, edge: Any, material: Any) -> Any:
        trial = elastic_trial(old, de, material.bulk, material.shear)
        return radial_return(trial, back, strain, factor, material)

    def transverse(old: Any, back: Any, de: Any, strain: Any, factor: Any, edge: Any, material: Any) -> Any:
        return transverse_return(old, back, de, strain, factor, unit(edge), material)

    return transverse if material.instance_class is TransverseNumbers else isotropic


def uniform_stiffness(B: Any, edge: Any, norm: Any, material: Any) -> Any:
    """Return an upper bound of the product of an element's stiffness against uniform strain and its volume.

    `B`: products BᵢBⱼ of the nodal gradients (xx, yy, zz, xy, yz, zx); `norm`: an upper bound of the norm of `B`.
    """
    raise NotImplementedError


@_overload(uniform_stiffness, jit_options=_INLINED)
def _uniform_stiffness(B: Any, edge: Any, norm: Any, material: Any) -> Any:
    def isotropic(B: Any, edge: Any, norm: Any, material: Any) -> Any:
        return material.lame * (B[0] + B[1] + B[2]) + TWO * material.shear * norm

    def transverse(B: Any, edge: Any, norm: Any, material: Any) -> Any:
        trace = material.bound_lame * (B[0] + B[1] + B[2])
        return trace + TWO * material.bound_shear * norm + material.bound_axial * _along(B, unit(edge))

    return transverse if material.instance_class is TransverseNumbers else isotropic


@inlined
def _along(B: Floats, a: Floats) -> Floats:
    """Return a·B a of a symmetric tensor B."""
    straight = a[0] * a[0] * B[0] + a[1] * a[1] * B[1] + a[2] * a[2] * B[2]
    return straight + TWO * (a[0] * a[1] * B[3] + a[1] * a[2] * B[4] + a[2] * a[0] * B[5])
