"""Soft shadows and ambient occlusion, baked from signed distance fields and triangles.

Casters become :class:`Occluders`, of which points (:class:`Query`, :func:`shade_shadow`, :func:`shade_ao`), lightmaps
(:class:`Charts`, :func:`bake_lightmap`), volumes (:func:`bake_volume`) and pictures (:func:`render`) are asked. A
:class:`Scene` bakes from files. Names are those of the C library without ``vsh_``; options are keywords, named and
documented in :mod:`vdbshade.types`; constants are words; errors are :class:`Error`. World space is right-handed, in scene
units; angles are radians. docs/python.md tells more.

Every call lets other threads of Python run. What is passed in must not be changed meanwhile.
"""
from . import types
from ._library import (ArgumentError, Cancelled, Error, InputError, InternalError, LimitError, OutOfMemoryError, ReadError,
                       UnsupportedError, VdbshadeWarning, WriteError)
from ._calls import Run
from ._bake_scene import (SceneBake, SceneLightmap, bake_scene, file_digest, forecast_scene, isa_available, merge_scene, part_words,
                          provenance, provenance_max_error, reader_confinement, version)
from ._compare import (Comparison, Limits, Measures, Tolerances, compare, compare_accuracy, compare_coverage, compare_files, compare_judge)
from ._flat import FlatScene, flat_bake, flat_light_name, flat_visibility
from ._grid import Grid, vdb_copy, vdb_list
from ._image import Image, ImageWriter, image_check, image_default_pack, image_read, image_write, srgb_to_linear
from ._light import Light, lights_read
from ._lightmap import (Charts, Lightmap, Texels, Volume, Voxels, bake_lightmap, bake_volume, charts_closeness, lightmap_fill_hidden,
                        lightmap_stitch, lightmaps_stitch)
from ._mesh import AlphaMask, Mesh, Model, mesh_solidity, unit
from ._occluders import Field, Heights, Layer, Occluders, Spheres, Triangles, spheres_read, trace_ao, trace_shadow
from ._points import (Query, Stats, ao_method_resolve, ao_method_traits, shade_ao, shade_irradiance, shade_shadow, shade_tint,
                      shadow_method_resolve, shadow_method_traits)
from ._render import Camera, LitMeshes, Picture, render
from ._scene import Assets, Scene, settings
from ._shapes import Outline, Sdf, Solids
from ._unwrap import Atlas, AtlasMesh, LitImage, lit_is_output, lit_write, unwrap, view_write

__version__ = version()
__all__ = [name for name in dir() if not name.startswith("_")]
