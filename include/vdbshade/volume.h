/* Volumes: shadow and ambient occlusion on voxels. */
#ifndef VDBSHADE_VOLUME_H
#define VDBSHADE_VOLUME_H

#include "parts.h"
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

/* "nearest" to VSH_INSIDE_NEAREST and back; -1 and NULL for what is none. Names are static strings; NULL is
 * none. */
VSH_API int32_t vsh_inside(const char *name);
VSH_API const char *vsh_inside_name(int32_t inside);

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

/* --- what it will take */

/* Found out by shading some of the blocks, from all over: times are good to some tenths. */
typedef struct vsh_volume_forecast {
    double bake_s;     /* seconds, by run's threads */
    double peak_bytes; /* of the process at most, as it is now and with all grids without tiles */
    int32_t grids;     /* that it will have */
} vsh_volume_forecast;

/* What vsh_bake_volume() would take of the same arguments; under its stage. Errors: as there. */
VSH_API vsh_result vsh_bake_volume_forecast_sized(const vsh_occluders *occluders, const vsh_voxels *voxels,
                                                  const vsh_light *lights, size_t light_count,
                                                  const vsh_volume_options *options, const vsh_run *run,
                                                  vsh_volume_forecast *forecast, size_t forecast_size,
                                                  vsh_error *error);
static inline vsh_result vsh_bake_volume_forecast(const vsh_occluders *occluders, const vsh_voxels *voxels,
                                                  const vsh_light *lights, size_t light_count,
                                                  const vsh_volume_options *options, const vsh_run *run,
                                                  vsh_volume_forecast *forecast, vsh_error *error) {
    return vsh_bake_volume_forecast_sized(occluders, voxels, lights, light_count, options, run, forecast,
                                          sizeof *forecast, error);
}

/* --- in parts */

/* How many of `shard_count` shards should have voxels (vsh_part_options.working): as many, 1 at least, as
 * have `least` seconds of one thread's work each, as far as the number of voxels, lights, AO and max_error
 * tell, rather too few than too many; 0 or less, NaN: all. Cannot fail. */
VSH_API int32_t vsh_volume_shards(double voxels, size_t light_count, const vsh_volume_options *options,
                                  double least, int32_t shard_count);

/* Bakes part shard of shard_count, as much work as any other that has voxels, and writes it to
 * PARTS.SHARD-of-COUNT.part, whole or not at all. Needs memory for the whole volume at most. A shard behind
 * part->working has no voxels: occluders and voxels may be NULL, and attributes are not looked at. Errors: as
 * vsh_bake_volume(); VSH_ERROR_ARGUMENT (part NULL or of another number), VSH_ERROR_WRITE. */
VSH_API vsh_result vsh_bake_volume_part(const vsh_occluders *occluders, const vsh_voxels *voxels,
                                        const vsh_light *lights, size_t light_count,
                                        const vsh_volume_options *options, const vsh_part_options *part,
                                        const vsh_run *run, vsh_shade_stats *stats, vsh_error *error);

/* Puts the parts of all shards together, which were baked of these voxels, lights and options: the same
 * volume as vsh_bake_volume() makes, bit by bit. Errors: as there, but of occluders; VSH_ERROR_READ (a part
 * is missing), VSH_ERROR_INPUT (there are none; one is damaged, or of other voxels, attributes or another
 * version, which it names). Other lights and options are noticed by attributes that tell of them, as those of
 * vsh_provenance_create() do; without, they are the caller's to keep. */
VSH_API vsh_result vsh_volume_merge(const vsh_voxels *voxels, const vsh_light *lights, size_t light_count,
                                    const vsh_volume_options *options, const vsh_part_options *parts,
                                    const vsh_run *run, vsh_volume **volume, vsh_shade_stats *stats,
                                    vsh_error *error);

/* What cast in the first part that is there, of `shard_count` shards, or (0) of however many there are: voxel
 * size, levels, voxels, bytes of fields, triangles. Errors: as vsh_part_words(). */
VSH_API vsh_result vsh_volume_part_casters_sized(const char *parts, int32_t shard_count, const vsh_run *run,
                                                 vsh_occluders_info *casters, size_t casters_size,
                                                 vsh_error *error);
static inline vsh_result vsh_volume_part_casters(const char *parts, int32_t shard_count, const vsh_run *run,
                                                 vsh_occluders_info *casters, vsh_error *error) {
    return vsh_volume_part_casters_sized(parts, shard_count, run, casters, sizeof *casters, error);
}

#ifdef __cplusplus
}
#endif
#endif
