/* Level sets of meshes, and rays against the one behind a grid, by OpenVDB's and NanoVDB's own code. */
#ifndef BENCH_VDB_H
#define BENCH_VDB_H

#include <stddef.h>
#include <stdint.h>
#include <vdbshade/grid.h>

#ifdef __cplusplus
extern "C" {
#endif

/* What both take: `count` rays from origins [count][3], world units, along the one `direction` (unit). hits
 * [count] takes 1 where a ray meets the surface, else 0. Where `mask` [count] is 0 nothing is traced. */
typedef struct vdb_rays {
    size_t count;
    const double *origins;
    const uint8_t *mask;
    double direction[3];
} vdb_rays;

typedef struct vdb_triangles {
    const float *positions;  /* [vertex_count][3] */
    const uint32_t *indices; /* [count][3] */
    size_t vertex_count, count;
} vdb_triangles;

/* openvdb::tools::meshToVolume on one thread, `half_width` voxels to either side; what it makes is freed. */
void vdb_mesh_to_volume(const vdb_triangles *triangles, double voxel, double half_width);

/* openvdb::tools::LevelSetRayIntersector, one a thread. */
typedef struct vdb_intersector vdb_intersector;
vdb_intersector *vdb_intersector_create(const vsh_grid *grid);
void vdb_intersector_trace(const vdb_intersector *intersector, const vdb_rays *rays, int threads,
                           uint8_t *hits);
void vdb_intersector_free(vdb_intersector *intersector);

/* A NanoVDB copy of the grid; NULL where this program was built without NanoVDB. */
typedef struct vdb_nano vdb_nano;
vdb_nano *vdb_nano_create(const vsh_grid *grid);
uint64_t vdb_nano_bytes(const vdb_nano *nanovdb);
/* nanovdb::ZeroCrossing: the value at the voxel whose corner lies below the ray's begin must be positive. */
void vdb_nano_trace(const vdb_nano *nanovdb, const vdb_rays *rays, int threads, uint8_t *hits);
/* Trilinear samples at world positions [count][3] with one accessor, world units. */
void vdb_nano_sample(const vdb_nano *nanovdb, size_t count, const double *positions, float *values);
void vdb_nano_free(vdb_nano *nanovdb);

#ifdef __cplusplus
}
#endif
#endif
