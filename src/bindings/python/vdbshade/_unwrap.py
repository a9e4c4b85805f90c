"""Lightmap UVs, assets with their light, and pages that show them."""
from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Dict, List, Optional, Sequence, Union

import numpy
from numpy.typing import ArrayLike

from . import types
from ._arrays import array, borrowed, pointer
from ._library import RUN, Handle, Run, call, ffi, handle_of, lib, make, place
from ._structs import Filled, info, path_of, told
from ._mesh import Mesh, Meshes, Model, meshes_of

if TYPE_CHECKING:
    from typing_extensions import Unpack


class AtlasMesh:
    """One mesh as it lies in the atlas; arrays are views.

    Attributes
    ----------
    uvs : array of float32, shape (vertices, 2)
        0 … 1 of the chart's page, v up
    sources : array of uint32, shape (vertices,)
        the vertex of the mesh that each is a copy of
    indices : array of uint32, shape (triangles, 3)
        the mesh's triangles in their order
    charts : array of uint32, shape (triangles,)
        2^32 - 1: of a triangle without area
    """

    def __init__(self, struct: Any, owner: Any) -> None:
        self.struct = struct
        n, m = struct.vertex_count, struct.triangle_count
        self.uvs = borrowed(struct.uvs, (n, 2), numpy.float32, owner)
        self.sources = borrowed(struct.sources, (n,), numpy.uint32, owner)
        self.indices = borrowed(struct.indices, (m, 3), numpy.uint32, owner)
        self.charts = borrowed(struct.charts, (m,), numpy.uint32, owner)

    def of(self, mesh: Mesh) -> Mesh:
        """The mesh that it was made of, with the atlas's vertices and UVs."""
        normals = None if mesh.normals is None else mesh.normals[self.sources]
        return Mesh(mesh.positions[self.sources], self.indices, normals=normals, uvs=self.uvs, transform=mesh.transform,
                    name=mesh.name or "mesh", object_name=mesh.object_name, object=mesh.object, solidity=mesh.solidity, alpha=mesh.alpha,
                    one_sided=mesh.one_sided, material_name=mesh.material_name, mask=mesh.mask,
                    mask_uvs=None if mesh.mask_uvs is None else mesh.mask_uvs[self.sources])


class Atlas(Handle):
    """Charts of meshes, packed into pages. A sequence of AtlasMesh."""

    @property
    def info(self) -> types.AtlasInfo:
        return info(lib.vsh_atlas_get_info, "vsh_atlas_info", self.handle)

    @property
    def pages(self) -> int:
        return lib.vsh_atlas_page_count(self.handle)

    def page(self, index: int) -> types.AtlasPage:
        """What a page comes to: its size (texels), texels_per_unit, share that is covered, first mesh."""
        if not -self.pages <= index < self.pages:
            raise IndexError(f"page {index}: the atlas has {self.pages}")
        return info(lib.vsh_atlas_page_view, "vsh_atlas_page", self.handle, index % self.pages)

    @property
    def charts(self) -> List[types.AtlasChart]:
        """All charts: page, mesh, stretch, area and the texels that each touches."""
        charts = lib.vsh_atlas_charts(self.handle)
        return [told(charts[i], "vsh_atlas_chart") for i in range(lib.vsh_atlas_chart_count(self.handle))]

    def __len__(self) -> int:
        return lib.vsh_atlas_mesh_count(self.handle)

    def __getitem__(self, index: int) -> AtlasMesh:
        if not -len(self) <= index < len(self):
            raise IndexError(f"mesh {index}: the atlas has {len(self)}")
        view = ffi.new("vsh_atlas_mesh *")
        view[0] = lib.vsh_atlas_mesh_view(self.handle, index % len(self))
        return AtlasMesh(view, self.handle)


def unwrap(meshes: Meshes, *, density: Optional[ArrayLike] = None, run: Optional[Run] = None,
           **options: "Unpack[types.UnwrapOptions]") -> Atlas:
    """Cuts meshes into charts, lays them out flat, and packs them into pages.

    Parameters
    ----------
    density : array of float64, shape (meshes,), optional
        factors of texels_per_unit
    **options
        vdbshade.types.UnwrapOptions: width, height (texels of a page), max_pages, padding, texels_per_unit (0: the most
        that fit), max_stretch, keep_uvs ("always" lays out anew, "keep" keeps UVs that can serve), atlas
        ("shared", or "objects": each has a page of its own), fit_pages (pages no larger than they need be)
    """
    structs, count, keeps = meshes_of(meshes)
    filled = Filled("vsh_unwrap_options", options)
    factors = None if density is None else array(density, numpy.float64, (count,), "density")
    filled.keeps.append(pointer(factors))
    filled.pointer.density = filled.keeps[-1]
    atlas = Atlas(make(lib.vsh_atlas_free, lib.vsh_unwrap, structs, count, filled.pointer, RUN, place("vsh_atlas"), run=run))
    del keeps
    return atlas


class LitImage:
    """An image of one page for one purpose.

    Parameters
    ----------
    purpose : str
        "occlusion", "lightmap" or "preview"
    image : bytes or array of float32, shape (height, width) or (height, width, 3)
        a PNG file's bytes, or linear planes, row 0 on top
    page : int
    **options
        vdbshade.types.LitImage: bits, intensity
    """

    def __init__(self, purpose: str, image: Union[bytes, ArrayLike], page: int = 0, *, bits: int = 0, intensity: float = 0.0) -> None:
        self._filled = Filled("vsh_lit_image", dict(purpose=purpose, page=page, bits=bits, intensity=intensity))
        self.struct = self._filled.pointer
        if isinstance(image, bytes):
            self._keeps: Any = ffi.from_buffer(image)
            self.struct.png, self.struct.png_size = self._keeps, len(image)
            return
        planes = numpy.asarray(image)
        if planes.ndim == 2:
            planes = planes[:, :, None]
        if planes.ndim != 3 or planes.shape[2] not in (1, 3):
            raise ValueError(f"image: expected shape (height, width) or (height, width, 3), got {planes.shape}")
        arrays = [array(planes[:, :, c], numpy.float32, planes.shape[:2], "image") for c in range(planes.shape[2])]
        channels = ffi.new("float *[]", [pointer(a) for a in arrays])
        self._keeps = (arrays, channels, [pointer(a) for a in arrays])
        self.struct.height, self.struct.width = planes.shape[:2]
        self.struct.channels, self.struct.channel_count = channels, len(arrays)


def lit_write(output: "str | os.PathLike[str]", model: Model, images: Sequence[LitImage], *, path: "str | os.PathLike[str] | None" = None,
              atlas: Optional[Atlas] = None, uv_sets: Optional[Sequence[int]] = None, image_place: str = "auto",
              run: Optional[Run] = None) -> None:
    """Writes a .glb or .gltf with its light (docs/lit.md).

    Parameters
    ----------
    model : Model
        what was read of `path`
    images : sequence of LitImage
    path : path, optional
        the model's file: a glTF is given back as it was; None: a document is made of the model
    atlas : Atlas, optional
        new UVs of the model's meshes; None: they have their lightmap in a set of their own
    uv_sets : sequence of int, optional
        without an atlas: the set of each mesh; -1: it stays unlit; None: as Model.mesh() takes it
    image_place : str
        "auto", "embed", "beside"
    """
    handle = handle_of(model, Model, "model")
    if not all(isinstance(image, LitImage) for image in images):
        raise TypeError("images: expected a list of vdbshade.LitImage")
    options = Filled("vsh_lit_options", dict(image_place=image_place))
    array_of = ffi.new("vsh_lit_image[]", [image.struct[0] for image in images] or 1)
    options.pointer.images, options.pointer.image_count = array_of, len(images)
    keeps: list = [array_of]
    meshes = ffi.NULL
    count = len(model)
    if atlas is not None:
        if len(atlas) != count:
            raise ValueError(f"atlas: of {len(atlas)} meshes, the model has {count}")
        pages = ffi.new("uint32_t[]", [chart.page for chart in atlas.charts] or 1)
        options.pointer.chart_pages, options.pointer.chart_count = pages, lib.vsh_atlas_chart_count(atlas.handle)
        views = [atlas[i].struct for i in range(count)]
        meshes = ffi.new("vsh_lit_mesh[]", [dict(uvs=v.uvs, sources=v.sources, indices=v.indices, charts=v.charts,
                                                 vertex_count=v.vertex_count, triangle_count=v.triangle_count) for v in views])
        keeps += [pages, atlas.handle]
    elif uv_sets is not None:
        if len(uv_sets) != count:
            raise ValueError(f"uv_sets: {len(uv_sets)} of {count} meshes")
        meshes = ffi.new("vsh_lit_mesh[]", count)
        for i in range(count):
            view = model.mesh(i)
            sources = numpy.arange(len(view.positions), dtype=numpy.uint32)
            keeps += [view, pointer(sources)]
            meshes[i].sources, meshes[i].vertex_count = keeps[-1], len(sources)
            meshes[i].indices, meshes[i].triangle_count = view.struct.indices, view.struct.triangle_count
            meshes[i].uv_set = uv_sets[i]
    call(lib.vsh_lit_write, ffi.NULL if path is None else path_of(path, "path"), handle, meshes, options.pointer,
         path_of(output, "output"), RUN, run=run)


def lit_is_output(path: "str | os.PathLike[str]") -> bool:
    """Whether a path ends as a file that lit_write() writes."""
    return bool(lib.vsh_lit_is_output(path_of(path, "path")))


def _bake(given: Dict[str, Any]) -> Filled:
    given = dict(given)
    planes = given.pop("planes", ())
    if isinstance(planes, (str, bytes, os.PathLike)):
        planes = [planes]
    filled = Filled("vsh_view_bake", given)
    names = ffi.new("char *[]", [filled.text(p, "planes") for p in planes] or 1)
    filled.keeps.append(names)
    filled.pointer.planes, filled.pointer.plane_count = names, len(planes)
    return filled


def view_write(path: "str | os.PathLike[str]", model: "str | os.PathLike[str]", planes: Any = (), *, uv_set: int = -1,
               name: Optional[str] = None, other: "Optional[types.ViewBake]" = None, run: Optional[Run] = None) -> None:
    """Writes one HTML page that shows a baked mesh in a browser (docs/view.md).

    Parameters
    ----------
    model : path
        the mesh's file
    planes : path or sequence of paths
        image files of its bake, one a page; none: its light is in its materials
    other : dict, optional
        a second bake beside it: model, planes, uv_set, name
    """
    first = _bake(dict(model=model, planes=planes, uv_set=uv_set, name=name))
    second = None if other is None else _bake(dict(other))
    call(lib.vsh_view_write, path_of(path, "path"), first.pointer, ffi.NULL if second is None else second.pointer, RUN, run=run)


__all__ = ["Atlas", "AtlasMesh", "LitImage", "lit_is_output", "lit_write", "unwrap", "view_write"]
