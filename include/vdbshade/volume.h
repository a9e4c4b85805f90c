/* Volumes: shadow and ambient occlusion on voxels. */
#ifndef VDBSHADE_VOLUME_H
#define VDBSHADE_VOLUME_H

#include "shade.h"
#include "voxels.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Voxels whose centre lies inside a solid, where light never comes. */
enum {
    VSH_INSIDE_NEAREST = 0, /* take the value of the nearest voxel that was shaded, up to four voxels off, so
                               that interpolating at the surface darkens nothing; deeper ones are left off */
    VSH_INSIDE_OFF = 1      /* are left off: inactive, background */
};

/* How voxels are shaded. */
typedef struct vsh_volume_options {
    size_t struct_size;
    int32_t inside;          /* VSH_INSIDE_… */
    int32_t ao;              /* nonzero: AO within shade.ao_distance, too. In free space, where there is no
                                surface, it is the free share of all directions, each counting alike (the
                                ambient light of a fog): shade.ao_cones cones or shade.rays rays over the whole
                                sphere; VSH_AO_TAPS has no meaning there, nor have layers of heights and spheres */
    int32_t error;           /* nonzero: the standard error left in each value, too, where methods know it */
    vsh_shade_options shade; /* start_offset and surface_offset count in a band only */
} vsh_volume_options;

static inline vsh_volume_options vsh_volume_options_default(void) {
    vsh_volume_options options = {sizeof(vsh_volume_options), VSH_INSIDE_NEAREST, 0, 0,
                                  vsh_shade_options_default()};
    return options;
}

/* Shades the voxels. Values are those of vsh_query_points() at vsh_voxels_centre(): in free space without
 * normals; in a band with the central differences of vsh_field_sample() half a voxel to either side of the
 * centre along each of the lattice's axes as normals (voxels where they vanish, between two walls, count as
 * inside). Which voxels are inside is decided by the sign of vsh_field_sample() in the
 * occluders' field, of the layers too. adaptive
 * and exact values are the same within their error. Runs under the stage "volume"; `stats` are added to. Free
 * the result with vsh_volume_free(). Errors:
 * - VSH_ERROR_ARGUMENT: occluders or voxels NULL, lights NULL with a count above 0, nothing to bake, two
 * lights of one name or one without, options out of range, VSH_AO_TAPS, or layers of heights or spheres with
 * AO, in free space, run, and as vsh_query_create();
 * - VSH_ERROR_LIMIT: run->memory_limit, or the machine's memory, for occluders, voxels and all grids without
 *   tiles;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_bake_volume(const vsh_occluders *occluders, const vsh_voxels *voxels,
                                   const vsh_light *lights, size_t light_count,
                                   const vsh_volume_options *options, const vsh_run *run, vsh_volume **volume,
                                   vsh_shade_stats *stats, vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
