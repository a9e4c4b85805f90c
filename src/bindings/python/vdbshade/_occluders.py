"""What casts, as one handle."""
from __future__ import annotations

from typing import TYPE_CHECKING, Any, Optional, Sequence

from ._library import RUN, Handle, Run, ffi, handle_of, lib, make, place
from ._structs import Filled, info, split
from ._field import Field, Heights, Spheres, Triangles
from ._grid import Grid
from ._mesh import Meshes, meshes_of
from ._sdf import Solids

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from . import types

_PARTS = {"field": Field, "triangles": Triangles, "heights": Heights, "spheres": Spheres, "true_triangles": Triangles,
          "true_solids": Solids}


class Layer:
    """Casters that are shaded in a way of their own: a part of Occluders.from_parts().

    Parameters
    ----------
    casters : Field, Heights or Spheres
    triangles : Triangles, optional
        of a field's casters, for exact methods
    lights : sequence of str, optional
        names of the lights it casts for; None: all
    **options
        members of ``vsh_layer`` (vdbshade.types.Layer): method, combine, softness, remap, start_offset, ao, name
    """

    def __init__(self, casters: Any, *, triangles: Optional[Triangles] = None, lights: Optional[Sequence[str]] = None,
                 **options: "Unpack[types.Layer]") -> None:
        place_of = next((name for name in ("field", "heights", "spheres") if isinstance(casters, _PARTS[name])), None)
        if place_of is None:
            raise TypeError(f"casters: expected a Field, Heights or Spheres, got {type(casters).__name__}")
        self._filled = Filled("vsh_layer", options)
        self.struct = self._filled.pointer
        setattr(self.struct, place_of, casters.handle)
        self.keeps: Any = [casters.handle, self._filled]
        if triangles is not None:
            self.struct.triangles = handle_of(triangles, Triangles, "triangles")
            self.keeps.append(triangles.handle)
        if lights is not None:
            names = ffi.new("char *[]", [self._filled.text(name, "lights") for name in lights] or 1)
            self.struct.lights, self.struct.light_count = names, len(lights)
            self.keeps.append(names)


class Occluders(Handle):
    """What casts: points, lightmaps, volumes, pictures and distances are asked of it.

    Parameters
    ----------
    meshes : Mesh, Model or sequence of Mesh
        their triangles are kept, and where voxels are asked for, a level set is made of them
    **options
        ``reach``, ``triangles`` (False: voxels alone) of vdbshade.types.OccludersOptions; ``voxel_size``,
        ``resolution``, ``half_width``, ``shell_thickness`` of vdbshade.types.GridOptions. Without a resolution or a
        voxel size there are no voxels, and only the methods auto and exact
    """

    def __init__(self, meshes: Meshes, *, run: Optional[Run] = None, **options: Any) -> None:
        structs, count, _ = meshes_of(meshes)
        mine, grid = split(options, "vsh_occluders_options", "vsh_grid_options")
        filled = Filled("vsh_occluders_options", dict(mine, grid=grid))
        super().__init__(make(lib.vsh_occluders_free, lib.vsh_occluders_create, structs, count, filled.pointer, RUN,
                              place("vsh_occluders"), run=run))

    @classmethod
    def _of(cls, cdata: Any, keeps: Any = None) -> "Occluders":
        self = cls.__new__(cls)
        Handle.__init__(self, cdata, keeps)
        return self

    @classmethod
    def from_grid(cls, grid: Grid, *, run: Optional[Run] = None, **options: "Unpack[types.FieldOptions]") -> "Occluders":
        """A level set as what casts: of a .vdb file, a function, a procedural tree."""
        return cls._of(make(lib.vsh_occluders_free, lib.vsh_occluders_from_grid, handle_of(grid, Grid, "grid"),
                            Filled("vsh_field_options", options).pointer, RUN, place("vsh_occluders"), run=run))

    @classmethod
    def from_parts(cls, field: Optional[Field] = None, *, triangles: Optional[Triangles] = None, layers: Sequence[Layer] = (),
                   true_triangles: Optional[Triangles] = None, true_solids: Optional[Solids] = None,
                   voxel_size: float = 0.0) -> "Occluders":
        """Of a field, triangles, layers, and what errors are measured against."""
        filled = Filled("vsh_occluder_parts", dict(voxel_size=voxel_size))
        keeps: list = []
        given = dict(field=field, triangles=triangles, true_triangles=true_triangles, true_solids=true_solids)
        for name, part in given.items():
            if part is not None:
                keeps.append(handle_of(part, _PARTS[name], name))
                setattr(filled.pointer, name, keeps[-1])
        if not all(isinstance(layer, Layer) for layer in layers):
            raise TypeError("layers: expected a list of vdbshade.Layer")
        array = ffi.new("vsh_layer[]", [layer.struct[0] for layer in layers] or 1)
        filled.pointer.layers, filled.pointer.layer_count = array, len(layers)
        keeps += [layer.keeps for layer in layers]

        def free(occluders: Any, keeps: Any = keeps) -> None:  # what it refers to lives until then
            lib.vsh_occluders_free(occluders)

        return cls._of(make(free, lib.vsh_occluders_from_parts, filled.pointer, place("vsh_occluders")))

    @property
    def info(self) -> "types.OccludersInfo":
        return info(lib.vsh_occluders_get_info, "vsh_occluders_info", self.handle)

    @property
    def field(self) -> Field:
        """Its field, which lives as long as anything that refers to either."""
        parts = ffi.new("vsh_occluder_parts *")
        lib.vsh_occluders_get_parts(self.handle, parts)
        field = Field.__new__(Field)
        owner = self.handle
        Handle.__init__(field, ffi.gc(ffi.cast("vsh_field *", parts.field), lambda _, keeps=owner: None), owner)
        return field


__all__ = ["Layer", "Occluders"]
