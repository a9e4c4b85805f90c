"""Lightmap UVs, assets with their light, and pages that show them."""
from __future__ import annotations

from typing import Any, List, Optional, Sequence, Union

import numpy
from numpy.typing import ArrayLike

from . import types
from ._arrays import array, borrowed, pointer
from ._calls import OUT, Handle, Run, ask, call, index_of
from ._library import Path, Unpack, ffi, lib
from ._mesh import Mesh, Meshes, Model, meshes_of
from ._structs import Filled, Struct, keep, path_of, structs_of, told


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


class Atlas(Handle, kind="vsh_atlas"):
    """Charts of meshes, packed into pages. A sequence of AtlasMesh."""

    info: types.AtlasInfo

    @property
    def pages(self) -> int:
        return ask(lib.vsh_atlas_page_count, self)

    def page(self, index: int) -> types.AtlasPage:
        """What a page comes to: its size (texels), texels_per_unit, share that is covered, first mesh."""
        return ask(lib.vsh_atlas_page_view, self, index_of(index, self.pages, "page", "the atlas has"))

    @property
    def charts(self) -> List[types.AtlasChart]:
        """All charts: page, mesh, stretch, area and the texels that each touches."""
        charts = lib.vsh_atlas_charts(self.handle)
        return [told(charts[i]) for i in range(lib.vsh_atlas_chart_count(self.handle))]

    def __len__(self) -> int:
        return ask(lib.vsh_atlas_mesh_count, self)

    def __getitem__(self, index: int) -> AtlasMesh:
        view = lib.vsh_atlas_mesh_view(self.handle, index_of(index, len(self), "mesh", "the atlas has"))
        return AtlasMesh(ffi.new("vsh_atlas_mesh *", view), self.handle)


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
    structs, count = meshes_of(meshes)
    factors = None if density is None else array(density, numpy.float64, (count,), "density")
    return Atlas(call(lib.vsh_unwrap, structs, count, Filled("vsh_unwrap_options", options, density=factors), OUT, run=run))


class LitImage(Struct, kind="vsh_lit_image"):
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
        filled = Filled("vsh_lit_image", purpose=purpose, page=page, bits=bits, intensity=intensity)
        self.struct = filled.struct
        if isinstance(image, bytes):
            filled.fill(dict(png=ffi.from_buffer(image), png_size=len(image)))
            return
        planes = numpy.asarray(image)
        if planes.ndim == 2:
            planes = planes[:, :, None]
        if planes.ndim != 3 or planes.shape[2] not in (1, 3):
            raise ValueError(f"image: expected shape (height, width) or (height, width, 3), got {planes.shape}")
        pointers = [pointer(array(planes[:, :, c], numpy.float32, planes.shape[:2], "image")) for c in range(planes.shape[2])]
        filled.fill(dict(height=planes.shape[0], width=planes.shape[1], channel_count=len(pointers),
                         channels=keep(ffi.new("float *[]", pointers), pointers)))


def lit_write(output: Path, model: Model, images: Sequence[LitImage], *, path: Optional[Path] = None,
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
    if not isinstance(model, Model):
        raise TypeError(f"model: expected a vdbshade.Model, got {type(model).__name__}")
    options = Filled("vsh_lit_options", image_place=image_place, images=images)
    meshes = None
    if atlas is not None:
        if len(atlas) != len(model):
            raise ValueError(f"atlas: of {len(atlas)} meshes, the model has {len(model)}")
        charts = atlas.charts
        options.fill(dict(chart_pages=ffi.new("uint32_t[]", [chart.page for chart in charts] or 1), chart_count=len(charts)))
        meshes = [{name: getattr(atlas[i].struct, name) for name in ("uvs", "sources", "indices", "charts", "vertex_count", "triangle_count")}
                  for i in range(len(model))]
    elif uv_sets is not None:
        if len(uv_sets) != len(model):
            raise ValueError(f"uv_sets: {len(uv_sets)} of {len(model)} meshes")
        meshes = [dict(sources=numpy.arange(len(mesh.positions), dtype=numpy.uint32), vertex_count=len(mesh.positions),
                       indices=mesh.indices, triangle_count=len(mesh.indices), uv_set=uv_set) for mesh, uv_set in zip(model, uv_sets)]
    call(lib.vsh_lit_write, None if path is None else path_of(path, "path"), model,
         None if meshes is None else structs_of("vsh_lit_mesh", meshes), options, path_of(output, "output"), run=run)


def lit_is_output(path: Path) -> bool:
    """Whether a path ends as a file that lit_write() writes."""
    return bool(ask(lib.vsh_lit_is_output, path_of(path, "path")))


def view_write(path: Path, model: Path, planes: Any = (), *, uv_set: int = -1,
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
    first = Filled("vsh_view_bake", model=model, planes=planes, uv_set=uv_set, name=name)
    second = None if other is None else Filled("vsh_view_bake", other)
    call(lib.vsh_view_write, path_of(path, "path"), first, second, run=run)
