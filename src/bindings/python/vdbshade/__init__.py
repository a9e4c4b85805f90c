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
from ._casters import (AlphaMask, Field, Grid, Heights, Layer, Light, Mesh, Model, Occluders, Outline, Sdf, Solids, Spheres, Triangles,
                       lights_read, mesh_solidity, spheres_read, trace_ao, trace_shadow, unit, vdb_copy, vdb_list)
from ._shading import (Camera, Charts, Image, ImageWriter, Lightmap, LitMeshes, Picture, Query, Stats, Texels, Volume, Voxels,
                       ao_method_resolve, ao_method_traits, bake_lightmap, bake_volume, charts_closeness, image_check,
                       image_default_pack, image_read, image_write, lightmap_fill_hidden, lightmap_stitch, lightmaps_stitch, render,
                       shade_ao, shade_irradiance, shade_shadow, shade_tint, shadow_method_resolve, shadow_method_traits,
                       srgb_to_linear)
from ._scene import (Assets, Atlas, AtlasMesh, Comparison, FlatScene, Limits, LitImage, Measures, Scene, SceneBake, SceneLightmap,
                     Tolerances, bake_scene, compare, compare_accuracy, compare_coverage, compare_files, compare_judge, file_digest,
                     flat_bake, flat_light_name, flat_visibility, forecast_scene, isa_available, lit_is_output, lit_write,
                     merge_scene, part_words, provenance, provenance_max_error, reader_confinement, settings, unwrap, version,
                     view_write)

__version__ = version()
__all__ = [name for name in dir() if not name.startswith("_")]
