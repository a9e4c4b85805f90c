"""Lightmaps against truth, for tools/bench-whole and tools/bench-cycles; needs the Python module of the build folder."""
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
    """Error of a file's channel against the truth's, over texels where A is 1 in the truth and in every file of `valid`: how many
    texels, RMSE, bias, 99th percentile, maximum."""
    mask = numpy.all([v.image_read(one)["A"] == 1 for one in (truth, *valid)], axis=0)
    error = (v.image_read(path)[of_file][mask] - v.image_read(truth)[channel][mask]).astype(float)
    return [len(error), math.sqrt(numpy.mean(error**2)), error.mean(), numpy.percentile(abs(error), 99), abs(error).max()]


def write_area_truth(v, path, asset, size, sun, degrees, distance, rays, samples, lift=1e-5):
    """Writes shadow.sun, ao and A, means over samples × samples places of each texel, by rays from the very surface."""
    meshes = v.Model(asset)
    triangles = v.Triangles(meshes)
    found = v.Charts(meshes, width=size, height=size, supersample=samples).texels().samples
    at = found["positions"] + lift * found["geometric_normals"]
    texels = (found["texels"] >> 16) * size + (found["texels"] & 0xffff)
    count = numpy.bincount(texels, minlength=size * size)
    light = v.Light(direction=sun, angle=math.radians(degrees))
    planes = dict(A=(count > 0).astype(numpy.float32))
    for name, values in (("shadow.sun", v.trace_shadow(at, found["normals"], light, triangles=triangles, rays=rays)),
                         ("ao", v.trace_ao(at, found["normals"], distance, triangles=triangles, rays=rays))):
        planes[name] = (numpy.bincount(texels, values, size * size) / numpy.maximum(count, 1)).astype(numpy.float32)
    v.image_write(path, {name: plane.reshape(size, size) for name, plane in planes.items()})
