"""Soft shadows and ambient occlusion, baked from signed distance fields and triangles.

Casters become :class:`Occluders`. These shade points (:class:`Query`, :func:`shade_shadow`, :func:`shade_ao`), lightmaps
(:class:`Charts`, :func:`bake_lightmap`), volumes (:func:`bake_volume`) and pictures (:func:`render`). A :class:`Scene` bakes from files. Names are those of the C library without ``vsh_``; options are keywords, named and
documented in :mod:`vdbshade.types`; constants are words; errors are :class:`Error`. World space is right-handed, in scene
units; angles are radians. docs/python.md tells more.

Every call lets other threads of Python run. Do not change arguments meanwhile.
"""
from . import types as types
from ._core import *
from ._casters import *
from ._shading import *
from ._scene import *

__version__ = version()
__all__ = [name for name in dir() if not name.startswith("_")]
