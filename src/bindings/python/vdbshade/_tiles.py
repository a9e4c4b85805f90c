"""Worlds in tiles: a scene that does not fit into memory as several that do."""
from __future__ import annotations

from typing import Any, Iterator, Optional

from ._library import RUN, Handle, Run, ffi, lib, make, place
from ._scene import Scene
from ._structs import Filled, info
from . import types


class Tile(Scene):
    """A tile as a scene of its own: some of the receivers, and of the casters those that their light and AO can meet. What
    receivers say may be set; casters, lights and AO stay as they were when the tile was made."""

    def __init__(self, handle: Any, keeps: Any) -> None:
        self._filled = Filled("vsh_scene")
        self._filled.keeps += [handle, keeps]
        self.struct = self._filled.pointer
        self.struct[0] = lib.vsh_tile_scene(handle)[0]
        self._receivers = ffi.new("vsh_receiver[]", [self.struct.receivers[i] for i in range(self.struct.receiver_count)])
        self.struct.receivers = self._receivers
        self.info: types.TileInfo = info(lib.vsh_tile_get_info_sized, "vsh_tile_info", handle)


class Tiles(Handle):
    """The tiles of a scene: a sequence of Tile, made as they are asked for. The scene must not be changed meanwhile.

    Parameters
    ----------
    scene : Scene
    size : float
        of a tile's sides, world units, > 0; receivers belong to the cube that their middle is in

    Examples
    --------
    >>> for tile in Tiles(Scene("world.json"), 100.0):
    ...     bake_scene(tile)
    """

    def __init__(self, scene: Scene, size: float, *, run: Optional[Run] = None) -> None:
        if not isinstance(scene, Scene):
            raise TypeError(f"scene: expected a vdbshade.Scene, got {type(scene).__name__}")
        self.scene = scene
        super().__init__(make(lib.vsh_tiles_free, lib.vsh_tiles_create, scene.struct, size, RUN, place("vsh_tiles"), run=run), scene)

    def __len__(self) -> int:
        return lib.vsh_tiles_count(self.handle)

    def __getitem__(self, index: int) -> Tile:
        if not -len(self) <= index < len(self):
            raise IndexError(f"tile {index}: there are {len(self)}")
        return Tile(make(lib.vsh_tile_free, lib.vsh_tile_create, self.handle, index % len(self), place("vsh_tile")),
                    (self.handle, self.scene))

    def __iter__(self) -> Iterator[Tile]:
        return (self[i] for i in range(len(self)))


__all__ = ["Tile", "Tiles"]
