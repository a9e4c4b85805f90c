// What OpenVDB and NanoVDB do with the same meshes and level sets. An exception ends the program: this is no
// library.
#include "vdb.h"

#include "levelset/grid.h"

#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/RayIntersector.h>

#ifdef BENCH_NANOVDB
#define NANOVDB_USE_OPENVDB
#include <nanovdb/util/HDDA.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <nanovdb/util/Ray.h>
#include <nanovdb/util/SampleFromVoxels.h>
#endif

namespace {

// body(i) over 0 … count - 1 in runs, each with what `make` gives it: a tracer of its own.
template <typename Make, typename Body> void run(size_t count, int threads, Make &&make, Body &&body) {
    tbb::task_arena arena(threads > 0 ? threads : int(tbb::task_arena::automatic));
    arena.execute([&] {
        tbb::parallel_for(tbb::blocked_range<size_t>(0, count, 1024),
                          [&](const tbb::blocked_range<size_t> &range) {
                              auto tracer = make();
                              for (size_t i = range.begin(); i != range.end(); ++i) {
                                  body(tracer, i);
                              }
                          });
    });
}

} // namespace

void vdb_mesh_to_volume(const vdb_triangles *triangles, double voxel, double half_width) {
    std::vector<openvdb::Vec3s> points(triangles->vertex_count);
    for (size_t i = 0; i < points.size(); ++i) {
        points[i] = openvdb::Vec3s(triangles->positions + 3 * i) / float(voxel);
    }
    std::vector<openvdb::Vec4I> polygons(triangles->count);
    for (size_t i = 0; i < polygons.size(); ++i) {
        const uint32_t *corner = triangles->indices + 3 * i;
        polygons[i] = {corner[0], corner[1], corner[2], openvdb::util::INVALID_IDX};
    }
    tbb::task_arena arena(1);
    arena.execute([&] {
        const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec4I> mesh(points,
                                                                                              polygons);
        const auto unit = openvdb::math::Transform::createLinearTransform(1.0);
        openvdb::tools::meshToVolume<openvdb::FloatGrid>(mesh, *unit, float(half_width), float(half_width));
    });
}

struct vdb_intersector {
    openvdb::FloatGrid::Ptr grid;
    openvdb::tools::LevelSetRayIntersector<openvdb::FloatGrid> intersector;
};

vdb_intersector *vdb_intersector_create(const vsh_grid *grid) {
    return new vdb_intersector{grid->level_set,
                               openvdb::tools::LevelSetRayIntersector<openvdb::FloatGrid>(*grid->level_set)};
}

void vdb_intersector_trace(const vdb_intersector *from, const vdb_rays *rays, int threads, uint8_t *hits) {
    const openvdb::Vec3d direction(rays->direction);
    run(
        rays->count, threads, [&] { return from->intersector; },
        [&](const auto &intersector, size_t i) {
            if (rays->mask[i]) {
                hits[i] = intersector.intersectsWS(
                    openvdb::math::Ray<double>(openvdb::Vec3d(&rays->origins[3 * i]), direction));
            }
        });
}

void vdb_intersector_free(vdb_intersector *intersector) {
    delete intersector;
}

#ifdef BENCH_NANOVDB

static nanovdb::Vec3d vec(const double *v) {
    return nanovdb::Vec3d(v[0], v[1], v[2]);
}

struct vdb_nano {
    nanovdb::GridHandle<> handle;
    const nanovdb::FloatGrid *grid;
};

vdb_nano *vdb_nano_create(const vsh_grid *grid) {
    auto made = new vdb_nano{nanovdb::openToNanoVDB(*grid->level_set), nullptr};
    made->grid = made->handle.grid<float>();
    return made;
}

uint64_t vdb_nano_bytes(const vdb_nano *nanovdb) {
    return nanovdb->handle.size();
}

void vdb_nano_trace(const vdb_nano *nanovdb, const vdb_rays *rays, int threads, uint8_t *hits) {
    using Ray = nanovdb::Ray<float>;
    const nanovdb::FloatGrid &grid = *nanovdb->grid;
    const auto turned = grid.worldToIndexDir(vec(rays->direction));
    const nanovdb::Vec3f direction(nanovdb::Vec3f(turned).normalize());
    run(
        rays->count, threads, [&] { return grid.getAccessor(); },
        [&](auto &accessor, size_t i) {
            if (rays->mask[i]) {
                const auto origin = grid.worldToIndex(vec(&rays->origins[3 * i]));
                Ray ray(nanovdb::Vec3f(origin), direction);
                nanovdb::Coord voxel;
                float value = 0.0F, time = 0.0F;
                hits[i] = nanovdb::ZeroCrossing(ray, accessor, voxel, value, time);
            }
        });
}

void vdb_nano_sample(const vdb_nano *nanovdb, size_t count, const double *positions, float *values) {
    const auto accessor = nanovdb->grid->getAccessor();
    const auto sampler = nanovdb::createSampler<1>(accessor);
    for (size_t i = 0; i < count; ++i) {
        const auto place = nanovdb->grid->worldToIndex(vec(&positions[3 * i]));
        values[i] = sampler(nanovdb::Vec3f(place));
    }
}

void vdb_nano_free(vdb_nano *nanovdb) {
    delete nanovdb;
}

#else

struct vdb_nano {};

vdb_nano *vdb_nano_create(const vsh_grid *) {
    return nullptr;
}
uint64_t vdb_nano_bytes(const vdb_nano *) {
    return 0;
}
void vdb_nano_trace(const vdb_nano *, const vdb_rays *, int, uint8_t *) {}
void vdb_nano_sample(const vdb_nano *, size_t, const double *, float *) {}
void vdb_nano_free(vdb_nano *) {}

#endif
