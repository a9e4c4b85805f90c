/* The functions of the module of level sets, which holds all code compiled against OpenVDB. This list
 * generates the members of the module's table, their values, and the library's functions that call them
 * (calls.c).
 *
 * MAKE(name, parameters, arguments, none) returns a vsh_result and loads the module; its last parameter is
 * `vsh_error *error`. If loading fails and `none` is not NULL, *none becomes 0. GIVE(result, name,
 * parameters, arguments) needs a handle that a MAKE made. DO(name, parameters, arguments) returns nothing,
 * and does nothing before the module is loaded. */
#pragma once

#include "levelset/access.h"

#include <vdbshade/grid.h>
#include <vdbshade/volume.h>

VSH_BEGIN_C

#define VSHI_SERVE_CALL(MAKE, name)                                                                          \
    MAKE(name,                                                                                               \
         (const char *path, vshi_decoder *request, const vsh_run *run, vshi_encoder *payload,                \
          vsh_error *error),                                                                                 \
         (path, request, run, payload, error), nothing)

#define VSHI_OPENVDB_CALLS(MAKE, GIVE, DO)                                                                   \
    MAKE(vsh_grid_from_meshes,                                                                               \
         (const vsh_mesh *meshes, size_t count, const vsh_grid_options *options, const vsh_run *run,         \
          vsh_grid **grid, vsh_error *error),                                                                \
         (meshes, count, options, run, grid, error), grid)                                                   \
    MAKE(vsh_grid_from_sdf,                                                                                  \
         (const vsh_sdf *sdf, const vsh_grid_options *options, const vsh_run *run, vsh_grid **grid,          \
          vsh_error *error),                                                                                 \
         (sdf, options, run, grid, error), grid)                                                             \
    MAKE(vsh_grid_from_distance,                                                                             \
         (const vsh_distance *field, const vsh_grid_options *options, const vsh_run *run, vsh_grid **grid,   \
          vsh_error *error),                                                                                 \
         (field, options, run, grid, error), grid)                                                           \
    MAKE(vsh_grid_from_distances,                                                                            \
         (const vsh_distance *field, vsh_distances_fn *distances, const vsh_grid_options *options,           \
          const vsh_run *run, vsh_grid **grid, vsh_error *error),                                            \
         (field, distances, options, run, grid, error), grid)                                                \
    MAKE(vsh_grid_unite,                                                                                     \
         (const vsh_grid_instance *instances, size_t count, const vsh_grid_options *options,                 \
          const vsh_run *run, vsh_grid **grid, vsh_error *error),                                            \
         (instances, count, options, run, grid, error), grid)                                                \
    MAKE(vsh_grid_read,                                                                                      \
         (const char *path, const char *name, const vsh_run *run, vsh_grid **grid, vsh_error *error),        \
         (path, name, run, grid, error), grid)                                                               \
    MAKE(vsh_vdb_list,                                                                                       \
         (const char *path, const vsh_run *run, vsh_vdb_entry *entries, size_t capacity, size_t *count,      \
          vsh_error *error),                                                                                 \
         (path, run, entries, capacity, count, error), count)                                                \
    MAKE(vshi_vdb_copy,                                                                                      \
         (const char *path, const char *name, const int32_t index_min[3], const int32_t size[3],             \
          const vsh_run *run, float *values, float *active, vsh_error *error),                               \
         (path, name, index_min, size, run, values, active, error), nothing)                                 \
    MAKE(vsh_voxels_from_grid,                                                                               \
         (const vsh_grid *grid, double band, const vsh_run *run, vsh_voxels **voxels, vsh_error *error),     \
         (grid, band, run, voxels, error), voxels)                                                           \
    MAKE(vsh_voxels_from_box,                                                                                \
         (const double box_min[3], const double box_max[3], double voxel_size, const vsh_run *run,           \
          vsh_voxels **voxels, vsh_error *error),                                                            \
         (box_min, box_max, voxel_size, run, voxels, error), voxels)                                         \
    MAKE(vsh_voxels_from_vdb,                                                                                \
         (const char *path, const char *name, const vsh_run *run, vsh_voxels **voxels, vsh_error *error),    \
         (path, name, run, voxels, error), voxels)                                                           \
    VSHI_SERVE_CALL(MAKE, vshi_serve_grid)                                                                   \
    VSHI_SERVE_CALL(MAKE, vshi_serve_list)                                                                   \
    VSHI_SERVE_CALL(MAKE, vshi_serve_voxels)                                                                 \
    VSHI_SERVE_CALL(MAKE, vshi_serve_copy)                                                                   \
    MAKE(vsh_grid_write,                                                                                     \
         (const vsh_grid *grid, const char *path, const char *name, const vsh_attribute *attributes,         \
          size_t count, vsh_error *error),                                                                   \
         (grid, path, name, attributes, count, error), nothing)                                              \
    MAKE(vsh_grid_copy,                                                                                      \
         (const vsh_grid *grid, const int32_t index_min[3], const int32_t size[3], float *values,            \
          vsh_error *error),                                                                                 \
         (grid, index_min, size, values, error), nothing)                                                    \
    MAKE(vsh_grid_from_openvdb,                                                                              \
         (const void *level_set, uint32_t version, uint32_t abi, const vsh_run *run, vsh_grid **grid,        \
          vsh_error *error),                                                                                 \
         (level_set, version, abi, run, grid, error), grid)                                                  \
    MAKE(vsh_grid_to_openvdb,                                                                                \
         (const vsh_grid *grid, uint32_t version, uint32_t abi, void *level_set, vsh_error *error),          \
         (grid, version, abi, level_set, error), nothing)                                                    \
    MAKE(vsh_volume_to_openvdb,                                                                              \
         (const vsh_volume *volume, size_t grid, uint32_t version, uint32_t abi, void *values,               \
          vsh_error *error),                                                                                 \
         (volume, grid, version, abi, values, error), nothing)                                               \
    MAKE(vsh_volume_copy,                                                                                    \
         (const vsh_volume *volume, size_t grid, const int32_t index_min[3], const int32_t size[3],          \
          float *values, vsh_error *error),                                                                  \
         (volume, grid, index_min, size, values, error), nothing)                                            \
    MAKE(vsh_volume_write,                                                                                   \
         (const vsh_volume *volume, const char *path, int32_t half, const vsh_attribute *attributes,         \
          size_t count, vsh_error *error),                                                                   \
         (volume, path, half, attributes, count, error), nothing)                                            \
    MAKE(vshi_volume_begin,                                                                                  \
         (const vsh_voxels *voxels, const vshi_channel *channels, size_t count, const vsh_run *run,          \
          double held, vsh_volume **volume, vsh_error *error),                                               \
         (voxels, channels, count, run, held, volume, error), volume)                                        \
    MAKE(vshi_volume_close, (vsh_volume * volume, const vsh_volume_info *counts, vsh_error *error),          \
         (volume, counts, error), nothing)                                                                   \
    GIVE(size_t, vshi_grid_leaves, (const vsh_grid *grid, vshi_leaf *leaves, size_t capacity),               \
         (grid, leaves, capacity))                                                                           \
    GIVE(float, vshi_volume_value, (const vsh_volume *volume, size_t channel, size_t block, int voxel),      \
         (volume, channel, block, voxel))                                                                    \
    GIVE(float *, vshi_volume_values, (vsh_volume * volume, size_t channel, size_t block),                   \
         (volume, channel, block))                                                                           \
    DO(vsh_grid_get_info, (const vsh_grid *grid, vsh_grid_info *info), (grid, info))                         \
    DO(vsh_grid_free, (vsh_grid * grid), (grid))                                                             \
    DO(vsh_voxels_free, (vsh_voxels * voxels), (voxels))                                                     \
    DO(vsh_volume_get_info, (const vsh_volume *volume, vsh_volume_info *info), (volume, info))               \
    DO(vsh_volume_get_grid, (const vsh_volume *volume, size_t grid, vsh_volume_grid *info),                  \
       (volume, grid, info))                                                                                 \
    DO(vsh_volume_free, (vsh_volume * volume), (volume))                                                     \
    DO(vshi_grid_block_signs,                                                                                \
       (const vsh_grid *grid, const int32_t origin[3], const int32_t size[3], int8_t *signs),                \
       (grid, origin, size, signs))                                                                          \
    DO(vshi_volume_set_tile, (vsh_volume * volume, size_t channel, size_t block, float value),               \
       (volume, channel, block, value))                                                                      \
    DO(vshi_volume_settle, (vsh_volume * volume, size_t block, const uint64_t mask[VSHI_MASK_WORDS]),        \
       (volume, block, mask))

#define VSHI_MEMBER_MAKE(name, parameters, arguments, none) vsh_result(*name) parameters;
#define VSHI_MEMBER_GIVE(result, name, parameters, arguments) result(*name) parameters;
#define VSHI_MEMBER_DO(name, parameters, arguments) void(*name) parameters;

typedef struct vshi_openvdb_table {
    const char *version; /* of the header that it was built with */
    VSHI_OPENVDB_CALLS(VSHI_MEMBER_MAKE, VSHI_MEMBER_GIVE, VSHI_MEMBER_DO)
} vshi_openvdb_table;

/* The module's one symbol. */
extern const vshi_openvdb_table vshi_openvdb_module;

VSH_END_C
