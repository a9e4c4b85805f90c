"""Casters and lights: meshes and models, shapes and outlines, level sets and occluders."""
from __future__ import annotations

from typing import Any, Callable, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple, Union, cast

import numpy
from numpy.typing import ArrayLike

from . import types
from ._core import (Array, array, ask, borrowed, call, constant, ffi, Filled, Floats, Handle, index_of, keep, lib, note, OUT, output, Path,
                    path_of, pointer, record_of, Run, Several, split, Struct, structs_of, transform as matrix, Unpack)

__all__ = ["AlphaMask", "Field", "Grid", "Light", "Mesh", "Model", "Occluders", "Outline", "Sdf", "lights_read", "mesh_solidity",
           "vdb_list"]

# --- lights


class Light(Struct, kind="vsh_light"):
    """A light. Each type uses its own members and ignores the others. A size of 0 makes hard shadows.

    Parameters
    ----------
    type : str
        "directional" (direction, angle), "sphere" (position, radius), "spot" (position, radius, axis, inner_angle,
        outer_angle) or "rectangle" (position, edge_u, edge_v, two_sided)
    **options
        members of ``vsh_light`` (vdbshade.types.Light): lengths in world units, angles in radians. `direction` points
        towards the light, `angle` is its angular diameter; `color` is linear RGB times intensity.

    Examples
    --------
    >>> Light("directional", direction=(0.4, 0.8, 0.3), angle=0.03, name="sun")
    <vdbshade.Light sun: directional …>
    """

    def __init__(self, type: types.LightType = "directional", **options: "Unpack[types.Light]") -> None:
        self.struct = Filled("vsh_light", options, type=type).struct
        call(lib.vsh_light_check, self)

    @classmethod
    def _of(cls, struct: Any) -> "Light":
        self = cls.__new__(cls)
        self.struct = ffi.new("vsh_light *", struct)
        return self

    def __repr__(self) -> str:
        text = ffi.new("char[]", 256)
        lib.vsh_light_text(self.struct, text, 256)
        return f"<vdbshade.Light {self.name}: {ffi.string(text).decode()}>"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Light) and record_of(self.struct) == record_of(other.struct)

    __hash__ = None  # type: ignore[assignment]


def lights_of(given: Union[Light, Sequence[Light]], name: str = "lights") -> Tuple[Any, int]:
    """Lights as ``vsh_light[]``, and their count."""
    lights = [given] if isinstance(given, Light) else list(given)
    if not all(isinstance(light, Light) for light in lights):
        raise TypeError(f"{name}: expected a vdbshade.Light, or several in a list")
    return structs_of("vsh_light", lights), len(lights)


def names_of(structs: Any, count: int) -> List[str]:
    """The names of lights, ``vsh_light[]``."""
    return [ffi.string(structs[i].name).decode() for i in range(count)]


def lights_read(path: Path, angle: float, radius: float, unit: float = 0.0, *, run: Optional[Run] = None) -> List[Light]:
    """The lights of a glTF file as lights of a scene, which have sizes.

    Parameters
    ----------
    angle : float
        of directional ones, angular diameter, radians
    radius : float
        of points, which become spheres, and spots, world units
    unit : float
        of the file's numbers, metres; 0: the file's own
    """
    lights, count = call(lib.vsh_lights_read, path_of(path, "path"), angle, radius, unit, OUT, OUT, run=run)
    return [Light._of(lights[i]) for i in range(count)]


# --- triangle meshes: arrays of the caller's, and models read from files


class AlphaMask(Struct, kind="vsh_alpha_mask"):
    """A texture that cuts holes into a mesh: light comes through where base_alpha × alpha, looked up bilinearly, is below
    alpha_cutoff.

    Parameters
    ----------
    alpha : array of uint8, shape (height, width)
        255 is 1, row 0 on top (v = 1); not copied if it is C-contiguous
    wrap : pair of str
        along u and v, where UVs leave 0 … 1: "repeat", "mirror", "clamp"
    uv_transform : array of float64, shape (2, 3), optional
        looked up at u' = a u + b v + c, v' = d u + e v + f; None: at u, v
    alpha_cutoff : float
        ≥ 0
    base_alpha : float
        0 … 1
    """

    def __init__(self, alpha: ArrayLike, *, wrap: Sequence[types.Wrap] = ("repeat", "repeat"), uv_transform: Optional[ArrayLike] = None,
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
    def uv_transform(self) -> Array:
        return numpy.array(list(self.struct.uv_transform)).reshape(2, 3)


class Mesh(Struct, kind="vsh_mesh"):
    """A triangle mesh: a view of arrays, which are not copied if they have the types below. They must not change while
    it is used.

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
        how it casts: "auto", "solid", "shell", "inward"
    alpha : str
        "opaque", "masked", "blended"
    one_sided : bool
        light on the backs of its faces passes through this caster; methods that march voxels ignore this
    material_name : str, optional
    mask : AlphaMask, optional
        holes
    mask_uvs : array of float32, shape (vertices, 2), optional
        texture coordinates for the mask, v up; triangles with coordinates that are not finite are opaque

    Notes
    -----
    Other kinds of numbers (float64 positions, int64 indices) are converted, which copies.
    """

    positions: Floats
    indices: Array
    normals: Optional[Floats]
    uvs: Optional[Floats]
    transform: Optional[Array]
    mask: Optional[AlphaMask]
    mask_uvs: Optional[Floats]

    def __init__(self, positions: ArrayLike, indices: ArrayLike, *, normals: Optional[ArrayLike] = None,
                 uvs: Optional[ArrayLike] = None, transform: Optional[ArrayLike] = None, name: str = "mesh",
                 object_name: Optional[str] = None, object: int = 0, solidity: types.Solidity = "auto", alpha: types.AlphaMode = "opaque", one_sided: bool = False,
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
        """A view of the library's mesh, which keeps `owner` alive."""
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
    def solidity(self) -> types.Solidity:
        return cast(types.Solidity, self.__getattr__("solidity"))

    @solidity.setter
    def solidity(self, value: types.Solidity) -> None:
        self.struct.solidity = constant("vsh_solidity", value, "solidity")

    @property
    def one_sided(self) -> bool:
        return bool(self.struct.one_sided)

    @one_sided.setter
    def one_sided(self, value: bool) -> None:
        self.struct.one_sided = bool(value)

    def __repr__(self) -> str:
        return f"<vdbshade.Mesh {self.name!r}: {len(self.positions)} vertices, {len(self.indices)} triangles>"

    def check(self) -> types.MeshReport:
        """Checks its data; InputError for numbers that are not finite or out of range."""
        report: types.MeshReport = call(lib.vsh_mesh_check, self, OUT)
        return report

    def measure_uvs(self, width: int, height: int) -> types.UvsMeasures:
        """Measures its UVs in a lightmap of this size (texels)."""
        measures: types.UvsMeasures = call(lib.vsh_uvs_measure, self, width, height, OUT)
        return measures


Meshes = Union[Mesh, "Model", Sequence[Mesh]]


def meshes_of(given: Meshes, name: str = "meshes") -> Tuple[Any, int]:
    """Meshes as ``vsh_mesh[]``, and their count."""
    if isinstance(given, Mesh):
        given = [given]
    meshes = list(given) if isinstance(given, (Model, list, tuple)) else None
    if meshes is None or not all(isinstance(m, Mesh) for m in meshes):
        raise TypeError(f"{name}: expected a vdbshade.Mesh, several in a list, or a vdbshade.Model")
    return structs_of("vsh_mesh", meshes), len(meshes)


def mesh_solidity(meshes: Meshes, *, run: Optional[Run] = None) -> List[types.SolidityReport]:
    """Counts the solids, rooms and sheets among the pieces of each mesh, if the meshes cast together."""
    structs, count = meshes_of(meshes)
    reports: List[types.SolidityReport] = call(lib.vsh_mesh_solidity, structs, count, Several(count), run=run)
    return reports


class Model(Handle, kind="vsh_model"):
    """A file of meshes: OBJ, glTF, GLB, PLY, STL, FBX, Collada (docs/formats.md). A sequence of its meshes, as views.

    Parameters
    ----------
    path : path
        its ending tells the format
    """

    def __init__(self, path: Path, *, run: Optional[Run] = None) -> None:
        super().__init__(call(lib.vsh_model_read, path_of(path, "path"), OUT, run=run))

    @classmethod
    def from_heights(cls, values: ArrayLike, *, what: types.HeightsPart = "solid", size: Sequence[float] = (1.0, 1.0), height: float = 1.0,
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
        return cls._of(call(lib.vsh_model_from_heights, source, constant("vsh_heights_part", what, "what"), OUT, run=run))

    def __len__(self) -> int:
        return int(lib.vsh_model_mesh_count(self.handle))

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
        return float(lib.vsh_model_unit(self.handle))

    def uv_sets(self, index: int) -> int:
        """The number of UV sets of a mesh."""
        return int(lib.vsh_model_uv_sets(self.handle, index_of(index, len(self), "mesh")))

    def densities(self, rules: Mapping[str, float], path: str = "model") -> Array:
        """The factor of the last rule that matches each mesh, else 1: an array of float64 of shape (meshes,), for unwrap().

        Parameters
        ----------
        rules : mapping
            factors by patterns of names, {"wall*": 2.0}; InputError for one that matches no mesh
        path : str
            the model's, for messages
        """
        factors = numpy.ones(len(self), numpy.float64)
        call(lib.vsh_model_densities, self, path_of(path, "path"), structs_of("vsh_density_rule", rules_of(rules, "factor")), len(rules),
             factors)
        return factors


def rules_of(given: Mapping[str, Any], member: str) -> List[Dict[str, Any]]:
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


# --- procedural shapes, and outlines in a plane


def instances_of(kind: str, given: Sequence[Any], matrix_of: Callable[[Any], Optional[Array]]) -> Any:
    """An array of instances: handles, or pairs of a handle and its transform."""
    member = kind[len("vsh_") : -len("_instance")]
    pairs = [entry if isinstance(entry, tuple) else (entry, None) for entry in given]
    return structs_of(kind, [{member: thing, "transform": matrix_of(moved)} for thing, moved in pairs])


def _turned(q: Array, v: Array) -> Array:
    t = 2.0 * numpy.cross(q[:3], v)
    return numpy.asarray(v + q[3] * t + numpy.cross(q[:3], t))


def _product(a: Array, b: Array) -> Array:
    return numpy.append(a[3] * b[:3] + b[3] * a[:3] + numpy.cross(a[:3], b[:3]), a[3] * b[3] - a[:3] @ b[:3])


class Sdf(Struct, kind="vsh_sdf"):
    """A tree of shapes; lengths in world units. ``a | b`` is a union, ``a & b`` an intersection, ``a - b`` a without b.

    Parameters
    ----------
    shape : str
        "sphere", "box", "torus", "plane", "capsule", "cylinder", "cone"
    **options
        members of ``vsh_sdf_node`` (vdbshade.types.SdfNode): size, radius, minor_radius, rounding, …

    Examples
    --------
    >>> plate = Sdf("box", size=(2, 0.1, 2)) - Sdf("cylinder", size=(1, 1, 1), radius=0.5)
    >>> ball = Sdf("sphere", radius=0.4).translated(0, 1, 0)
    >>> Occluders.from_grid(Grid.from_sdf(plate | ball, voxel_size=0.02))
    <vdbshade.Occluders …>
    """

    def __init__(self, shape: types.SdfShape = "sphere", **options: "Unpack[types.SdfNode]") -> None:
        self._nodes: List[Dict[str, Any]] = [dict(options, shape=shape)]
        if "left" in options or "right" in options:
            raise TypeError("Sdf: operands are combined by |, &, - and smooth_union()")
        self._made()

    def _made(self) -> None:
        nodes = structs_of("vsh_sdf_node", self._nodes)
        self.struct = keep(ffi.new("vsh_sdf *", [nodes, len(self._nodes)]), nodes)
    
    @classmethod
    def _of(cls, nodes: List[Dict[str, Any]]) -> "Sdf":
        self = cls.__new__(cls)
        self._nodes = nodes
        self._made()
        return self

    def _combined(self, other: "Sdf", shape: str, **options: Any) -> "Sdf":
        if not isinstance(other, Sdf):
            raise TypeError(f"expected a vdbshade.Sdf, got {type(other).__name__}")
        offset = len(self._nodes)
        moved = [{k: v + offset if k in ("left", "right") else v for k, v in node.items()} for node in other._nodes]
        root = dict(options, shape=shape, left=offset - 1, right=offset + len(moved) - 1)
        return Sdf._of(self._nodes + moved + [root])

    def __or__(self, other: "Sdf") -> "Sdf":
        return self._combined(other, "union")

    def __and__(self, other: "Sdf") -> "Sdf":
        return self._combined(other, "intersection")

    def __sub__(self, other: "Sdf") -> "Sdf":
        return self._combined(other, "subtraction")

    def smooth_union(self, other: "Sdf", smoothing: float) -> "Sdf":
        """A union, blended over a distance."""
        return self._combined(other, "smooth_union", smoothing=smoothing)

    def moved(self, translation: Sequence[float] = (0.0, 0.0, 0.0), rotation: Sequence[float] = (0.0, 0.0, 0.0, 1.0),
              scale: float = 1.0) -> "Sdf":
        """Scaled, then rotated (a quaternion x, y, z, w), then translated."""
        root = dict(self._nodes[-1])
        turn = numpy.asarray(rotation, float)
        if turn.shape != (4,) or not numpy.linalg.norm(turn) > 0.0:
            raise ValueError(f"rotation {rotation}: expected a quaternion x, y, z, w of some length")
        turn = turn / numpy.linalg.norm(turn)
        before = numpy.asarray(root.get("rotation", (0.0, 0.0, 0.0, 1.0)), float)
        place_before = numpy.asarray(root.get("translation", (0.0, 0.0, 0.0)), float)
        if "rotation" in root or tuple(rotation) != (0.0, 0.0, 0.0, 1.0):
            root["rotation"] = tuple(_product(turn, before))
        root["translation"] = tuple(_turned(turn, scale * place_before) + numpy.asarray(translation, float))
        root["scale"] = scale * root.get("scale", 1.0)
        return Sdf._of(self._nodes[:-1] + [root])

    def translated(self, x: float, y: float, z: float) -> "Sdf":
        return self.moved(translation=(x, y, z))

    def scaled(self, scale: float) -> "Sdf":
        return self.moved(scale=scale)

    def rotated(self, axis: Sequence[float], angle: float) -> "Sdf":
        """Turned around an axis through the origin by an angle, radians."""
        unit = numpy.asarray(axis, float) / numpy.linalg.norm(axis)
        return self.moved(rotation=(*(unit * numpy.sin(angle / 2)), numpy.cos(angle / 2)))

    def __len__(self) -> int:
        """The number of nodes of the tree."""
        return len(self._nodes)


class Outline(Handle, kind="vsh_outline"):
    """An area of the xy-plane, bounded by closed contours; world units, y up. Made by ``from_polygons``."""

    def __init__(self, *arguments: Any) -> None:
        raise TypeError("an Outline is made by Outline.from_polygons()")

    @classmethod
    def from_polygons(cls, polygons: Sequence[ArrayLike], *, run: Optional[Run] = None) -> "Outline":
        """The area that closed polygons wind around: arrays of float64 of shape (n, 2)."""
        parts = [array(p, numpy.float64, (None, 2), f"polygons[{i}]") for i, p in enumerate(polygons)]
        points = numpy.concatenate(parts) if parts else numpy.zeros((0, 2))
        counts = ffi.new("size_t[]", [len(p) for p in parts] or 1)
        return cls._of(call(lib.vsh_outline_from_polygons, points, counts, len(parts), OUT, run=run))


# --- narrow-band level sets


Attributes = Mapping[str, str]


def attributes_of(given: Optional[Attributes]) -> List[Dict[str, str]]:
    """Lines of text that a file carries, as members of ``vsh_attribute``."""
    return [dict(name=name, value=value) for name, value in (given or {}).items()]


def attribute_structs(given: Optional[Attributes]) -> Tuple[Any, int]:
    """Attributes as ``vsh_attribute[]``, and their count."""
    lines = attributes_of(given)
    return structs_of("vsh_attribute", lines), len(lines)


class _Distance:
    """The caller's distance function, while a grid is made from it."""

    def __init__(self, function: Callable[[Array], Any]) -> None:
        self.function = function
        self.raised: Optional[BaseException] = None


# Called by several threads, which hold the GIL here in turn.
@ffi.callback("vsh_distances_fn *", onerror=note)
def _distances(user: Any, count: int, positions: Any, distances: Any) -> None:
    running = ffi.from_handle(user)
    result = numpy.frombuffer(ffi.buffer(distances, 8 * count), numpy.float64)
    result[:] = numpy.nan  # ends the call if the function raises
    if running.raised is None:
        # a copy, because C frees the array after the call
        at = numpy.array(numpy.frombuffer(ffi.buffer(positions, 24 * count), numpy.float64)).reshape(count, 3)
        at.flags.writeable = False
        found = numpy.asarray(running.function(at), numpy.float64)
        if found.shape != (count,):
            raise ValueError(f"distance function: expected {count} distances for {count} positions, got shape {found.shape}")
        result[:] = found


class Grid(Handle, kind="vsh_grid"):
    """A level set: OpenVDB's grid of floats. Made by its ``from_…`` methods and ``read``.

    Voxels are given by `voxel_size` (world units) or `resolution` (voxels along the longest side, 256), the band's
    `half_width` and sheets' `shell_thickness` in voxels (vdbshade.types.GridOptions).
    """

    info: types.GridInfo

    def __init__(self, *arguments: Any) -> None:
        raise TypeError("a Grid is made by Grid.from_meshes(), from_sdf(), from_distance(), from_outline(), unite() or read()")

    @classmethod
    def from_meshes(cls, meshes: Meshes, *, run: Optional[Run] = None, **options: "Unpack[types.GridOptions]") -> "Grid":
        """The union of the meshes as solids, rooms, walls and sheets (see mesh_solidity)."""
        return cls._of(call(lib.vsh_grid_from_meshes, *meshes_of(meshes), Filled("vsh_grid_options", options), OUT, run=run))

    @classmethod
    def from_sdf(cls, sdf: Sdf, *, run: Optional[Run] = None, **options: "Unpack[types.GridOptions]") -> "Grid":
        """A procedural tree, voxelised where its surface is."""
        return cls._of(call(lib.vsh_grid_from_sdf, sdf, Filled("vsh_grid_options", options), OUT, run=run))

    @classmethod
    def from_distance(cls, distance: Callable[[Array], ArrayLike], bounds_min: Sequence[float],
                      bounds_max: Sequence[float], *, lipschitz: float = 1.0, exact: bool = True,
                      run: Optional[Run] = None, **options: "Unpack[types.GridOptions]") -> "Grid":
        """A field that a Python function gives, voxelised where its surface is.

        Parameters
        ----------
        distance : callable
            called with positions, an array of float64 of shape (n, 3) that it may not keep (n is 64, 8 or 1); returns
            signed distances, shape (n,), world units, negative inside. It is called from several threads, one at a
            time, and has to give the same value for the same position. This raises what it raises.
        bounds_min, bounds_max : three floats
            a world box that holds the whole surface
        lipschitz : float
            largest difference of two distances, divided by how far apart their positions are; 1 for true distances
        exact : bool
            True: it returns true distances near the surface; False: distances are measured anew, which calls it for single
            positions and takes ten times as long
        """
        if not callable(distance):
            raise TypeError(f"distance: expected a function, got {type(distance).__name__}")
        given = _Distance(distance)
        filled = Filled("vsh_distance", lipschitz=lipschitz, exact=exact, bounds_min=bounds_min, bounds_max=bounds_max,
                        user=ffi.new_handle(given))
        return cls._of(call(lib.vsh_grid_from_distances, filled, _distances, Filled("vsh_grid_options", options), OUT, run=run,
                            watched=given))

    @classmethod
    def from_outline(cls, outline: Outline, thickness: float, *, transform: Optional[ArrayLike] = None,
                     run: Optional[Run] = None, **options: "Unpack[types.GridOptions]") -> "Grid":
        """An outline extruded along z by a thickness, local units; `transform` (3, 4) as of unite()."""
        return cls._of(call(lib.vsh_grid_from_outline, outline, thickness, matrix(transform), Filled("vsh_grid_options", options), OUT,
                            run=run))

    @classmethod
    def read(cls, path: Path, name: Optional[str] = None, *, run: Optional[Run] = None) -> "Grid":
        """A level set of a .vdb file; `name` None: its first."""
        return cls._of(call(lib.vsh_grid_read, path_of(path, "path"), name, OUT, run=run))

    @classmethod
    def unite(cls, grids: "Sequence[Union[Grid, Tuple[Grid, ArrayLike]]]", *, run: Optional[Run] = None,
              **options: "Unpack[types.GridOptions]") -> "Grid":
        """The union of grids, or of pairs of a grid and its transform, shape (3, 4): rotation, translation, mirroring
        and one scale."""
        instances = instances_of("vsh_grid_instance", grids, matrix)
        return cls._of(call(lib.vsh_grid_unite, instances, len(grids), Filled("vsh_grid_options", options), OUT, run=run))

    def write(self, path: Path, name: Optional[str] = None, attributes: Optional[Attributes] = None) -> None:
        """Writes a .vdb file, whole or not at all; `name` None: "surface"."""
        call(lib.vsh_grid_write, self, path_of(path, "path"), name, *attribute_structs(attributes))

    def values(self, index_min: Optional[Sequence[int]] = None, shape: Optional[Sequence[int]] = None,
               out: Optional[Floats] = None) -> Floats:
        """A dense copy of its distances.

        Parameters
        ----------
        index_min : three ints, optional
            the first voxel: x, y, z; None: the first of the band
        shape : three ints, optional
            depth, height, width: voxels along z, y, x; None: to the last of the band
        out : array of float32, shape (depth, height, width), optional
            to be written into

        Returns
        -------
        array of float32, shape (depth, height, width)
            world units, negative inside; beyond the band ± its half width
        """
        return dense(self.info, index_min, shape, out, lambda *box: call(lib.vsh_grid_copy, self, *box))


def dense(box: Any, index_min: Optional[Sequence[int]], shape: Optional[Sequence[int]], out: Optional[Floats],
          copy: Callable[[Any, Any, Any], Any]) -> Floats:
    """Fills a dense array of voxels; `box` has index_min and index_max."""
    low = [int(i) for i in (box.index_min if index_min is None else index_min)]
    if shape is None:
        shape = out.shape if out is not None else [box.index_max[2 - i] + 1 - low[2 - i] for i in range(3)]
    if len(low) != 3 or len(shape) != 3 or not all(1 <= n < 2**31 for n in shape) or not all(abs(i) < 2**31 for i in low):
        raise ValueError(f"index_min {tuple(low)}, shape {tuple(shape)}: expected three indices, and sizes of at least 1")
    values = output(out, numpy.float32, tuple(int(n) for n in shape), "out")
    copy(ffi.new("int32_t[3]", low), ffi.new("int32_t[3]", [int(n) for n in reversed(shape)]), values)
    return values


def vdb_list(path: Path, *, run: Optional[Run] = None) -> List[types.VdbEntry]:
    """Lists the grids of a .vdb file, of any kind."""
    count, capacity = ffi.new("size_t *"), 16
    while True:
        entries = ffi.new("vsh_vdb_entry[]", capacity)
        call(lib.vsh_vdb_list, path_of(path, "path"), entries, capacity, count, run=run)
        if count[0] <= capacity:
            return [record_of(entries[i]) for i in range(count[0])]
        capacity = count[0]


# --- occluders and their fields


class Field(Handle, kind="vsh_field"):
    """The pyramid of narrow bands that shadow marching samples. Belongs to Occluders."""

    info: types.FieldInfo

    def sample(self, positions: ArrayLike, out: Optional[Floats] = None) -> Floats:
        """Signed distance.

        Parameters
        ----------
        positions : array of float64, shape (n, 3)
            world units
        out : array of float32, shape (n,), optional

        Returns
        -------
        array of float32, shape (n,)
            world units, negative inside; NaN for positions that are not finite
        """
        at = array(positions, numpy.float64, (None, 3), "positions")
        distances = output(out, numpy.float32, (len(at),), "out")
        lib.vsh_field_sample(self.handle, len(at), pointer(at), pointer(distances))
        return distances


class Occluders(Handle, kind="vsh_occluders"):
    """Everything that casts shadows. Points, lightmaps, volumes, pictures and distances are computed from it.

    Parameters
    ----------
    meshes : Mesh, Model or sequence of Mesh
        their triangles are kept; with a resolution or voxel size, they also become a level set
    **options
        ``reach``, ``triangles`` (False: voxels alone) of vdbshade.types.OccludersOptions; ``voxel_size``,
        ``resolution``, ``half_width``, ``shell_thickness`` of vdbshade.types.GridOptions. Without a resolution or a
        voxel size there are no voxels, and only the methods auto and exact
    """

    info: types.OccludersInfo

    def __init__(self, meshes: Meshes, *, run: Optional[Run] = None, **options: "Unpack[types.OccludersKeywords]") -> None:
        mine, grid = split(options, "vsh_occluders_options", "vsh_grid_options")
        super().__init__(call(lib.vsh_occluders_create, *meshes_of(meshes), Filled("vsh_occluders_options", mine, grid=grid), OUT, run=run))

    @classmethod
    def from_grid(cls, grid: Grid, *, run: Optional[Run] = None, **options: "Unpack[types.OccludersOptions]") -> "Occluders":
        """Casters made of a level set: of a .vdb file, a function or a procedural tree. Options: ``reach``, ``grown``."""
        return cls._of(call(lib.vsh_occluders_from_grid, grid, Filled("vsh_occluders_options", options), OUT, run=run))

    @property
    def field(self) -> Optional[Field]:
        """The field of its casters in no layer, which keeps them alive; None if they have no voxels."""
        return self.layer_field(None)

    def layer_field(self, layer: Optional[str]) -> Optional[Field]:
        """The field of a scene's layer."""
        return Field._borrow(ask(lib.vsh_occluders_get_field, self, layer), self.handle)
