"""Triangle meshes: arrays of the caller's, and models read from files."""
from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Iterator, List, Mapping, Optional, Sequence, Tuple, Union

import numpy
from numpy.typing import ArrayLike

from . import types
from ._arrays import array, borrowed, pointer, transform as matrix
from ._library import RUN, Handle, Run, call, ffi, lib, make, place, text
from ._structs import Filled, constant, info, path_of, told, word

if TYPE_CHECKING:
    from ._light import Light


class AlphaMask:
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
        self.struct = ffi.new("vsh_alpha_mask *")
        self._keeps: Any = pointer(self.alpha)
        self.struct.alpha, self.struct.alpha_cutoff, self.struct.base_alpha = self._keeps, alpha_cutoff, base_alpha
        self.struct.height, self.struct.width = self.alpha.shape
        self.struct.wrap = [constant("VSH_WRAP_", w, "wrap") for w in wrap]
        self.struct.uv_transform = list(moved.flat)

    @classmethod
    def _view(cls, given: Any, owner: Any) -> "AlphaMask":
        self = cls.__new__(cls)
        self.struct, self._keeps = ffi.new("vsh_alpha_mask *", given), owner
        self.alpha = borrowed(given.alpha, (given.height, given.width), numpy.uint8, owner)
        return self

    @property
    def wrap(self) -> Tuple[str, str]:
        return word("VSH_WRAP_", self.struct.wrap[0]), word("VSH_WRAP_", self.struct.wrap[1])

    @property
    def uv_transform(self) -> numpy.ndarray:
        return numpy.array(list(self.struct.uv_transform)).reshape(2, 3)

    @property
    def alpha_cutoff(self) -> float:
        return self.struct.alpha_cutoff

    @property
    def base_alpha(self) -> float:
        return self.struct.base_alpha


class Mesh:
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
        self._filled = Filled("vsh_mesh", dict(name=name, object_name=object_name, object=object, solidity=solidity, alpha=alpha,
                                               one_sided=bool(one_sided), material_name=material_name))
        struct = self._filled.pointer
        struct.vertex_count, struct.triangle_count = count, len(self.indices)
        self._arrays = [pointer(a) for a in (self.positions, self.normals, self.uvs, self.indices, self.transform, self.mask_uvs)]
        struct.positions, struct.normals, struct.uvs, struct.indices, struct.transform, struct.mask_uvs = self._arrays
        if mask is not None:
            struct.mask = mask.struct
            self._arrays.append(mask)
        self.struct = struct

    @classmethod
    def _view(cls, given: Any, owner: Any) -> "Mesh":
        """A view of what the library has, which `owner` keeps."""
        self = cls.__new__(cls)
        self.struct = ffi.new("vsh_mesh *", given)
        self._arrays = owner
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
    def name(self) -> Optional[str]:
        return text(self.struct.name)

    @property
    def object_name(self) -> Optional[str]:
        return text(self.struct.object_name)

    @property
    def object(self) -> int:
        return self.struct.object

    @property
    def solidity(self) -> str:
        return word("VSH_SOLIDITY_", self.struct.solidity)

    @solidity.setter
    def solidity(self, value: str) -> None:
        self.struct.solidity = constant("VSH_SOLIDITY_", value, "solidity")

    @property
    def alpha(self) -> str:
        return word("VSH_ALPHA_", self.struct.alpha)

    @property
    def one_sided(self) -> bool:
        return bool(self.struct.one_sided)

    @one_sided.setter
    def one_sided(self, value: bool) -> None:
        self.struct.one_sided = bool(value)

    @property
    def material_name(self) -> Optional[str]:
        return text(self.struct.material_name)

    def __repr__(self) -> str:
        return f"<vdbshade.Mesh {self.name!r}: {len(self.positions)} vertices, {len(self.indices)} triangles>"

    def matches(self, pattern: str) -> bool:
        """Whether it is meant by a pattern: its name or its object's as a shell matches them."""
        return bool(lib.vsh_mesh_matches(self.struct, pattern.encode()))

    def check(self) -> types.MeshReport:
        """Looks it over; InputError for what is not finite or out of range."""
        report = ffi.new("vsh_mesh_report *")
        call(lib.vsh_mesh_check, self.struct, report)
        return told(report[0], "vsh_mesh_report")

    def uvs_usable(self, *, run: Optional[Run] = None) -> bool:
        """Whether a lightmap can be baked by its own UVs: in the unit square, none over another."""
        usable = ffi.new("int32_t *")
        call(lib.vsh_uvs_usable, self.struct, RUN, usable, run=run)
        return bool(usable[0])

    def measure_uvs(self, width: int, height: int) -> types.UvsMeasures:
        """How its UVs lie on its surface, in a lightmap of this size (texels)."""
        measures = ffi.new("vsh_uvs_measures *")
        call(lib.vsh_uvs_measure, self.struct, width, height, measures)
        return told(measures[0], "vsh_uvs_measures")


Meshes = Union[Mesh, "Model", Sequence[Mesh]]


def meshes_of(given: Meshes, name: str = "meshes") -> Tuple[Any, int, List[Mesh]]:
    """Meshes as C takes them: ``vsh_mesh[]``, how many, and what they are of."""
    if isinstance(given, Mesh):
        given = [given]
    meshes = list(given) if isinstance(given, (Model, list, tuple)) else None
    if meshes is None or not all(isinstance(m, Mesh) for m in meshes):
        raise TypeError(f"{name}: expected a vdbshade.Mesh, several in a list, or a vdbshade.Model")
    structs = ffi.new("vsh_mesh[]", max(len(meshes), 1))
    for i, mesh in enumerate(meshes):
        structs[i] = mesh.struct[0]
    return structs, len(meshes), meshes


def mesh_solidity(meshes: Meshes, *, run: Optional[Run] = None) -> List[types.SolidityReport]:
    """What the pieces of meshes that cast together are taken for: a report for each mesh."""
    structs, count, _ = meshes_of(meshes)
    reports = ffi.new("vsh_solidity_report[]", max(count, 1))
    call(lib.vsh_mesh_solidity, structs, count, RUN, reports, run=run)
    return [told(reports[i], "vsh_solidity_report") for i in range(count)]


def unit(name: str) -> float:
    """Metres in a unit: "m", "cm", "mm", "in", "ft"; 0 for what is none."""
    return lib.vsh_unit(name.encode())


class Model(Handle):
    """A file of meshes: OBJ, glTF, GLB, PLY, STL, FBX, Collada (docs/meshes.md). A sequence of its meshes, as views.

    Parameters
    ----------
    path : path
        its ending tells the format
    """

    def __init__(self, path: "str | os.PathLike[str]", *, run: Optional[Run] = None) -> None:
        super().__init__(make(lib.vsh_model_free, lib.vsh_model_read, path_of(path, "path"), RUN, place("vsh_model"), run=run))

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
        source, keeps = heights_source(values, size, height, base, transform, name)
        self = cls.__new__(cls)
        Handle.__init__(self, make(lib.vsh_model_free, lib.vsh_model_from_heights, source, constant("VSH_HEIGHTS_", what, "what"),
                                   RUN, place("vsh_model"), run=run))
        return self

    def __len__(self) -> int:
        return lib.vsh_model_mesh_count(self.handle)

    def __getitem__(self, index: int) -> Mesh:
        return self.mesh(index)

    def __iter__(self) -> Iterator[Mesh]:
        return (self.mesh(i) for i in range(len(self)))

    def _index(self, index: int, count: int, what: str) -> int:
        if not -count <= index < count:
            raise IndexError(f"{what} {index}: there are {count}")
        return index % count

    def mesh(self, index: int, uv_set: int = -1) -> Mesh:
        """A view of a mesh, with the UVs of a set; -1: the second where there is one, else the first."""
        index = self._index(index, len(self), "mesh")
        if not -1 <= uv_set < 8:
            raise ValueError(f"uv_set {uv_set}: expected -1 … 7")
        return Mesh._view(lib.vsh_model_mesh(self.handle, index, uv_set), self.handle)

    @property
    def unit(self) -> float:
        """Metres in one unit of the file, by which positions were multiplied; 0: the format has none."""
        return lib.vsh_model_unit(self.handle)

    def uv_sets(self, index: int) -> int:
        """How many sets of UVs a mesh has."""
        return lib.vsh_model_uv_sets(self.handle, self._index(index, len(self), "mesh"))

    @property
    def materials(self) -> List[types.ModelMaterial]:
        """Materials of a glTF or an OBJ, as far as they decide where light comes through."""
        return [info(lib.vsh_model_get_material, "vsh_model_material", self.handle, i)
                for i in range(lib.vsh_model_material_count(self.handle))]

    def mesh_material(self, index: int) -> int:
        """The material of a mesh; -1: none."""
        return lib.vsh_model_mesh_material(self.handle, self._index(index, len(self), "mesh"))

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
        structs, keeps = density_rules(rules)
        factors = numpy.ones(len(self), numpy.float64)
        call(lib.vsh_model_densities, self.handle, path_of(path, "path"), structs, len(rules), pointer(factors))
        del keeps
        return factors

    @property
    def lights(self) -> List[types.ModelLight]:
        """Lights of a glTF."""
        return [info(lib.vsh_model_get_light, "vsh_model_light", self.handle, i)
                for i in range(lib.vsh_model_light_count(self.handle))]

    def lights_from_model(self, angle: float, radius: float, unit: float = 0.0) -> "List[Light]":
        """Its lights as those of a scene, which have sizes.

        Parameters
        ----------
        angle : float
            of directional ones, angular diameter, radians
        radius : float
            of points and spots, world units
        """
        from ._light import Light
        lights, count = ffi.new("vsh_light **"), ffi.new("size_t *")
        call(lib.vsh_lights_from_model, self.handle, angle, radius, unit, lights, count)
        owned = ffi.gc(lights[0], lib.vsh_lights_free)
        return [Light._of(owned[i]) for i in range(count[0])]


def density_rules(given: Mapping[str, float]) -> Tuple[Any, Any]:
    """``vsh_density_rule[]``, and what it points to."""
    names = [ffi.new("char[]", pattern.encode()) for pattern in given]
    rules = [dict(pattern=name, factor=float(factor)) for name, factor in zip(names, given.values())]
    return ffi.new("vsh_density_rule[]", rules or 1), names


def heights_source(values: ArrayLike, size: Sequence[float], height: float, base: float, transform: Optional[ArrayLike],
                   name: str) -> Tuple[Any, Any]:
    """``vsh_heights_source`` and what it points to."""
    given = numpy.asarray(values)
    if max(given.shape, default=0) > 65536:  # before it is copied
        raise ValueError(f"values: expected at most 65536 rows and columns, got {given.shape}")
    heights = array(given, numpy.float32, (None, None), "values")
    filled = Filled("vsh_heights_source", dict(name=name, size=size, height=height, base=base))
    moved = matrix(transform)
    keeps = [filled, pointer(heights), pointer(moved)]
    source = filled.pointer
    source.rows, source.columns = heights.shape
    source.values, source.transform = keeps[1], keeps[2]
    return source, keeps


__all__ = ["AlphaMask", "Mesh", "Model", "mesh_solidity", "unit"]
