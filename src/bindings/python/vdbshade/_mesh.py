"""Triangle meshes: arrays of the caller's, and models read from files."""
from __future__ import annotations

from typing import Any, Iterator, List, Mapping, Optional, Sequence, Tuple, Union

import numpy
from numpy.typing import ArrayLike

from . import types
from ._arrays import array, borrowed, transform as matrix
from ._calls import OUT, Handle, Run, Several, ask, call, index_of
from ._library import Path, ffi, lib
from ._light import Light
from ._structs import Filled, Struct, constant, path_of, structs_of


class AlphaMask(Struct, kind="vsh_alpha_mask"):
    """Where a mesh is cut out by a texture: light comes through where base_alpha × alpha, looked up bilinearly, is below
    alpha_cutoff.

    Parameters
    ----------
    alpha : array of uint8, shape (height, width)
        255 is 1, row 0 on top (v = 1); used as it is where it is C-contiguous
    wrap : pair of str
        along u and v, where UVs leave 0 … 1: "repeat", "mirror", "clamp"
    uv_transform : array of float64, shape (2, 3), optional
        looked up at u' = a u + b v + c, v' = d u + e v + f; None: at u, v
    alpha_cutoff : float
        ≥ 0
    base_alpha : float
        0 … 1
    """

    def __init__(self, alpha: ArrayLike, *, wrap: Sequence[str] = ("repeat", "repeat"), uv_transform: Optional[ArrayLike] = None,
                 alpha_cutoff: float = 0.5, base_alpha: float = 1.0) -> None:
        self.alpha = array(alpha, numpy.uint8, (None, None), "alpha")
        moved = array([[1.0, 0, 0], [0, 1, 0]] if uv_transform is None else uv_transform, numpy.float64, (2, 3), "uv_transform")
        if max(self.alpha.shape) >= 2**31 or len(wrap) != 2:
            raise ValueError("alpha: too large" if len(wrap) == 2 else f"wrap: expected 2 words, got {len(wrap)}")
        height, width = self.alpha.shape
        self.struct = Filled("vsh_alpha_mask", alpha=self.alpha, width=width, height=height, wrap=wrap, uv_transform=moved.flat,
                             alpha_cutoff=alpha_cutoff, base_alpha=base_alpha).struct

    @classmethod
    def _view(cls, given: Any, owner: Any) -> "AlphaMask":
        self = cls.__new__(cls)
        self.struct, self._owner = ffi.new("vsh_alpha_mask *", given), owner
        self.alpha = borrowed(given.alpha, (given.height, given.width), numpy.uint8, owner)
        return self

    @property
    def uv_transform(self) -> numpy.ndarray:
        return numpy.array(list(self.struct.uv_transform)).reshape(2, 3)


class Mesh(Struct, kind="vsh_mesh"):
    """A triangle mesh: a view of arrays, which are not copied where they are as below. They must not change while it
    is used.

    Parameters
    ----------
    positions : array of float32, shape (vertices, 3)
        local units, finite
    indices : array of uint32, shape (triangles, 3)
        each below the number of vertices, anticlockwise from outside
    normals : array of float32, shape (vertices, 3), optional
        shading normals of any length; None: flat
    uvs : array of float32, shape (vertices, 2), optional
        lightmap coordinates, v up
    transform : array of float64, shape (3, 4) or (4, 4), optional
        local to world; column 3 translates
    name, object_name : str
        for messages and patterns
    object : int
        meshes of one number are parts of one object; 0: an object of its own
    solidity : str
        what it is taken for where it casts: "auto", "solid", "shell", "inward"
    alpha : str
        "opaque", "masked", "blended"
    one_sided : bool
        where it casts, light that falls on the backs of its faces comes through; methods that march voxels take no notice
    material_name : str, optional
    mask : AlphaMask, optional
        where it is cut out
    mask_uvs : array of float32, shape (vertices, 2), optional
        texture coordinates for the mask, v up; what is not finite is opaque

    Notes
    -----
    Other kinds of numbers (float64 positions, int64 indices) are converted, which copies.
    """

    positions: numpy.ndarray
    indices: numpy.ndarray
    normals: Optional[numpy.ndarray]
    uvs: Optional[numpy.ndarray]
    transform: Optional[numpy.ndarray]
    mask: Optional[AlphaMask]
    mask_uvs: Optional[numpy.ndarray]

    def __init__(self, positions: ArrayLike, indices: ArrayLike, *, normals: Optional[ArrayLike] = None,
                 uvs: Optional[ArrayLike] = None, transform: Optional[ArrayLike] = None, name: str = "mesh",
                 object_name: Optional[str] = None, object: int = 0, solidity: str = "auto", alpha: str = "opaque", one_sided: bool = False,
                 material_name: Optional[str] = None, mask: Optional[AlphaMask] = None, mask_uvs: Optional[ArrayLike] = None) -> None:
        self.positions = array(positions, numpy.float32, (None, 3), "positions")
        self.indices = array(indices, numpy.uint32, (None, 3), "indices")
        count = len(self.positions)
        self.normals = None if normals is None else array(normals, numpy.float32, (count, 3), "normals")
        self.uvs = None if uvs is None else array(uvs, numpy.float32, (count, 2), "uvs")
        self.transform = matrix(transform)
        if mask is not None and not isinstance(mask, AlphaMask):
            raise TypeError(f"mask: expected a vdbshade.AlphaMask, got {type(mask).__name__}")
        if (mask is None) != (mask_uvs is None):
            raise ValueError("mask, mask_uvs: expected both, or none")
        self.mask = mask
        self.mask_uvs = None if mask_uvs is None else array(mask_uvs, numpy.float32, (count, 2), "mask_uvs")
        self.struct = Filled("vsh_mesh", name=name, object_name=object_name, object=object, solidity=solidity, alpha=alpha,
                             one_sided=bool(one_sided), material_name=material_name, positions=self.positions, normals=self.normals,
                             uvs=self.uvs, indices=self.indices, transform=self.transform, mask_uvs=self.mask_uvs, mask=mask,
                             vertex_count=count, triangle_count=len(self.indices)).struct

    @classmethod
    def _view(cls, given: Any, owner: Any) -> "Mesh":
        """A view of what the library has, which `owner` keeps."""
        self = cls.__new__(cls)
        self.struct, self._owner = ffi.new("vsh_mesh *", given), owner
        n, m = given.vertex_count, given.triangle_count
        self.positions = borrowed(given.positions, (n, 3), numpy.float32, owner)
        self.indices = borrowed(given.indices, (m, 3), numpy.uint32, owner)
        self.normals = borrowed(given.normals, (n, 3), numpy.float32, owner)
        self.uvs = borrowed(given.uvs, (n, 2), numpy.float32, owner)
        self.transform = borrowed(given.transform, (3, 4), numpy.float64, owner)
        self.mask = None if given.mask == ffi.NULL else AlphaMask._view(given.mask[0], owner)
        self.mask_uvs = borrowed(given.mask_uvs, (n, 2), numpy.float32, owner)
        return self

    @property
    def solidity(self) -> str:
        return self.__getattr__("solidity")

    @solidity.setter
    def solidity(self, value: str) -> None:
        self.struct.solidity = constant("VSH_SOLIDITY_", value, "solidity")

    @property
    def one_sided(self) -> bool:
        return bool(self.struct.one_sided)

    @one_sided.setter
    def one_sided(self, value: bool) -> None:
        self.struct.one_sided = bool(value)

    def __repr__(self) -> str:
        return f"<vdbshade.Mesh {self.name!r}: {len(self.positions)} vertices, {len(self.indices)} triangles>"

    def matches(self, pattern: str) -> bool:
        """Whether it is meant by a pattern: its name or its object's as a shell matches them."""
        return bool(ask(lib.vsh_mesh_matches, self, pattern))

    def check(self) -> types.MeshReport:
        """Looks it over; InputError for what is not finite or out of range."""
        return call(lib.vsh_mesh_check, self, OUT)

    def uvs_usable(self, *, run: Optional[Run] = None) -> bool:
        """Whether a lightmap can be baked by its own UVs: in the unit square, none over another."""
        return bool(call(lib.vsh_uvs_usable, self, OUT, run=run))

    def measure_uvs(self, width: int, height: int) -> types.UvsMeasures:
        """How its UVs lie on its surface, in a lightmap of this size (texels)."""
        return call(lib.vsh_uvs_measure, self, width, height, OUT)


Meshes = Union[Mesh, "Model", Sequence[Mesh]]


def meshes_of(given: Meshes, name: str = "meshes") -> Tuple[Any, int]:
    """Meshes as C takes them: ``vsh_mesh[]`` and how many."""
    if isinstance(given, Mesh):
        given = [given]
    meshes = list(given) if isinstance(given, (Model, list, tuple)) else None
    if meshes is None or not all(isinstance(m, Mesh) for m in meshes):
        raise TypeError(f"{name}: expected a vdbshade.Mesh, several in a list, or a vdbshade.Model")
    return structs_of("vsh_mesh", meshes), len(meshes)


def mesh_solidity(meshes: Meshes, *, run: Optional[Run] = None) -> List[types.SolidityReport]:
    """What the pieces of meshes that cast together are taken for: a report for each mesh."""
    structs, count = meshes_of(meshes)
    return call(lib.vsh_mesh_solidity, structs, count, Several(count), run=run)


def unit(name: str) -> float:
    """Metres in a unit: "m", "cm", "mm", "in", "ft"; 0 for what is none."""
    return ask(lib.vsh_unit, name)


class Model(Handle, kind="vsh_model"):
    """A file of meshes: OBJ, glTF, GLB, PLY, STL, FBX, Collada (docs/meshes.md). A sequence of its meshes, as views.

    Parameters
    ----------
    path : path
        its ending tells the format
    """

    def __init__(self, path: Path, *, run: Optional[Run] = None) -> None:
        super().__init__(call(lib.vsh_model_read, path_of(path, "path"), OUT, run=run))

    @classmethod
    def from_heights(cls, values: ArrayLike, *, what: str = "solid", size: Sequence[float] = (1.0, 1.0), height: float = 1.0,
                     base: float = 0.0, transform: Optional[ArrayLike] = None, name: str = "heights",
                     run: Optional[Run] = None) -> "Model":
        """A heightfield as a mesh.

        Parameters
        ----------
        values : array of float32, shape (rows, columns)
        what : str
            "solid": closed, a caster; "surface": the top alone with UVs, a receiver
        size : two floats
            along x and z, local units
        height, base : float
            of a value of 1, and under the lowest sample (0: a twentieth of the longer side), local units
        """
        source = heights_source(values, size, height, base, transform, name)
        return cls._of(call(lib.vsh_model_from_heights, source, constant("VSH_HEIGHTS_", what, "what"), OUT, run=run))

    def __len__(self) -> int:
        return lib.vsh_model_mesh_count(self.handle)

    def __getitem__(self, index: int) -> Mesh:
        return self.mesh(index)

    def __iter__(self) -> Iterator[Mesh]:
        return (self.mesh(i) for i in range(len(self)))

    def mesh(self, index: int, uv_set: int = -1) -> Mesh:
        """A view of a mesh, with the UVs of a set; -1: the second where there is one, else the first."""
        index = index_of(index, len(self), "mesh")
        if not -1 <= uv_set < 8:
            raise ValueError(f"uv_set {uv_set}: expected -1 … 7")
        return Mesh._view(lib.vsh_model_mesh(self.handle, index, uv_set), self.handle)

    @property
    def unit(self) -> float:
        """Metres in one unit of the file, by which positions were multiplied; 0: the format has none."""
        return lib.vsh_model_unit(self.handle)

    def uv_sets(self, index: int) -> int:
        """How many sets of UVs a mesh has."""
        return lib.vsh_model_uv_sets(self.handle, index_of(index, len(self), "mesh"))

    @property
    def materials(self) -> List[types.ModelMaterial]:
        """Materials of a glTF or an OBJ, as far as they decide where light comes through."""
        return [ask(lib.vsh_model_get_material, self, i) for i in range(lib.vsh_model_material_count(self.handle))]

    def mesh_material(self, index: int) -> int:
        """The material of a mesh; -1: none."""
        return lib.vsh_model_mesh_material(self.handle, index_of(index, len(self), "mesh"))

    def densities(self, rules: Mapping[str, float], path: str = "model") -> numpy.ndarray:
        """For each of its meshes the factor of the last rule that means it, else 1: an array of float64 of shape (meshes,), as
        unwrap() takes it.

        Parameters
        ----------
        rules : mapping
            factors by patterns of names, {"wall*": 2.0}; InputError for one that means no mesh
        path : str
            the model's, for messages
        """
        factors = numpy.ones(len(self), numpy.float64)
        call(lib.vsh_model_densities, self, path_of(path, "path"), structs_of("vsh_density_rule", rules_of(rules, "factor")), len(rules),
             factors)
        return factors

    @property
    def lights(self) -> List[types.ModelLight]:
        """Lights of a glTF."""
        return [ask(lib.vsh_model_get_light, self, i) for i in range(lib.vsh_model_light_count(self.handle))]

    def lights_from_model(self, angle: float, radius: float, unit: float = 0.0) -> "List[Light]":
        """Its lights as those of a scene, which have sizes.

        Parameters
        ----------
        angle : float
            of directional ones, angular diameter, radians
        radius : float
            of points and spots, world units
        """
        lights, count = call(lib.vsh_lights_from_model, self, angle, radius, unit, OUT, OUT)
        return [Light._of(lights[i]) for i in range(count)]


def rules_of(given: Mapping[str, Any], member: str) -> List[dict]:
    """Rules by their patterns, as dicts of a struct's members."""
    return [{"pattern": pattern, member: value} for pattern, value in given.items()]


def heights_source(values: ArrayLike, size: Sequence[float], height: float, base: float, transform: Optional[ArrayLike], name: str) -> Filled:
    """``vsh_heights_source``."""
    given = numpy.asarray(values)
    if max(given.shape, default=0) > 65536:  # before it is copied
        raise ValueError(f"values: expected at most 65536 rows and columns, got {given.shape}")
    heights = array(given, numpy.float32, (None, None), "values")
    rows, columns = heights.shape
    return Filled("vsh_heights_source", name=name, size=size, height=height, base=base, values=heights, rows=rows, columns=columns,
                  transform=matrix(transform))
