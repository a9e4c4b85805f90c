"""Soft shadows and ambient occlusion, baked from signed distance fields and triangles.

Casters become :class:`Occluders`. These shade points (:class:`Query`, :func:`shade_shadow`, :func:`shade_ao`), lightmaps
(:class:`Charts`, :func:`bake_lightmap`), volumes (:func:`bake_volume`) and pictures (:func:`render`). A :class:`Scene` bakes from files. Names are those of the C library without ``vsh_``; options are keywords, named and
documented in :mod:`vdbshade.types`; constants are words; errors are :class:`Error`. World space is right-handed, in scene
units; angles are radians. docs/python.md tells more.

Every call lets other threads of Python run. Do not change arguments meanwhile.
"""
from . import types
from ._core import (ArgumentError, Cancelled, Error, InputError, InternalError, LimitError, OutOfMemoryError, ReadError, Run,
                    UnsupportedError, VdbshadeWarning, WriteError)
from ._casters import (AlphaMask, Field, Grid, Light, Mesh, Model, Occluders, Outline, Sdf, lights_read, mesh_solidity, vdb_list)
from ._shading import (Camera, Charts, Image, Lightmap, LitMeshes, Picture, Query, Stats, Volume, Voxels, ao_method_traits, bake_lightmap,
                       bake_volume, image_check, image_read, image_write, lightmap_fill_hidden, lightmaps_stitch, render, shade_ao,
                       shade_irradiance, shade_shadow, shadow_method_traits)
from ._scene import (Assets, Atlas, AtlasMesh, Comparison, FlatScene, LitImage, Measures, Scene, SceneBake, SceneLightmap, bake_scene,
                     compare, compare_accuracy, compare_files, file_digest, flat_light_name, forecast_scene, lit_is_output, lit_write,
                     merge_scene, part_words, provenance, reader_confinement, settings, unwrap, version, view_write)

__version__ = version()
__all__ = [name for name in dir() if not name.startswith("_")]
