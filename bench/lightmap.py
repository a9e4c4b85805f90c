"""Compares lightmaps with truth, for whole.py and cycles.py. Needs the Python module of the build folder."""
import math
import pathlib
import sys

import numpy


def load(build):
    """The Python module of a build folder."""
    sys.path.insert(0, str(pathlib.Path(build) / "python"))
    import vdbshade
    return vdbshade


def compare(v, truth, channel, path, of_file, *valid):
    """Error of a file's channel against the truth's, over texels where A is 1 in the truth and in every file of `valid`. Returns the
    number of texels, RMSE, bias, 99th percentile and maximum."""
    mask = numpy.all([v.image_read(one)["A"] == 1 for one in (truth, *valid)], axis=0)
    error = (v.image_read(path)[of_file][mask] - v.image_read(truth)[channel][mask]).astype(float)
    return [len(error), math.sqrt(numpy.mean(error**2)), error.mean(), numpy.percentile(abs(error), 99), abs(error).max()]


def write_area_truth(v, path, asset, size, sun, degrees, distance, rays, samples):
    """Writes shadow.sun, ao and A as means over samples × samples places of each texel, traced against triangles."""
    meshes = v.Model(asset)
    charts = v.Charts(meshes, width=size, height=size, supersample=samples, padding=0)
    light = v.Light(direction=sun, angle=math.radians(degrees))
    v.bake_lightmap(v.Occluders(meshes), charts, light, ao=True, ao_distance=distance, method="exact", ao_method="exact", rays=rays,
                    max_error=1e-4, frame=1).write(path)
