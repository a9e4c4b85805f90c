/* Shadow and ambient occlusion at points, asked for again and again: one at a time, or ten million at once.
 */
#ifndef VDBSHADE_QUERY_H
#define VDBSHADE_QUERY_H

#include "shade.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Occluders, lights and options that are checked and made ready once, so that a call for one point costs
 * little more than its march. Immutable; may be shared by threads. */
typedef struct vsh_query vsh_query;

/* Lights [light_count] (NULL for none: AO only) and options are copied; the occluders
 * must outlive the handle. Free with vsh_query_free(). Errors: VSH_ERROR_ARGUMENT (options out of range, a
 * light that vsh_light_check() refuses, its number in the message, an exact method of occluders without
 * triangles: the shadow's only where there are lights), VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_query_create(const vsh_occluders *occluders, const vsh_light *lights,
                                    size_t light_count, const vsh_shade_options *options, vsh_query **query,
                                    vsh_error *error);
VSH_API void vsh_query_free(vsh_query *query); /* NULL does nothing */

/* Where values go, in the points' order; what is NULL costs nothing. Values are those of vsh_shade_shadow(),
 * vsh_shade_ao() and, of the occluders' field, vsh_field_sample(). */
typedef struct vsh_query_output {
    size_t struct_size;
    float *const *visibility; /* [light_count] arrays [count], each or all of them NULL where not asked for */
    float *const *deviation;  /* the standard error left in them, likewise, of lights whose visibility is
                                 asked for */
    float *ao;                /* [count]; needs normals */
    float *ao_deviation;      /* [count], with `ao` */
    float *distance;          /* [count], of the point itself (no start offset), signed, world units: negative
                                 inside; NaN where the position is not finite */
    float *gradient; /* [count][3], unit: the direction in which the distance grows, next to a surface
                        its normal, beyond the finest band within some degrees. 0, 0, 0 where the field
                        has none: beyond its reach, at the middle of a sphere. NaN where the position is
                        not finite */
    size_t stride;   /* bytes from one point's value to the next in every array, a multiple of 4, at
                        least 4, with `gradient` 12; 0: as above, without gaps */
} vsh_query_output;

static inline vsh_query_output vsh_query_output_default(void) {
    vsh_query_output output = {sizeof(vsh_query_output), NULL, NULL, NULL, NULL, NULL, NULL, 0};
    return output;
}

/* How the points of a call stand in the caller's memory, in an array of structs say. Strides are bytes from
 * one point to the next, multiples of what they step over (4, of doubles 8) and at least a point long; 0:
 * without gaps. */
typedef struct vsh_point_layout {
    size_t struct_size;
    const float *float_positions; /* [count][3]: in place of points->positions, which is then NULL; the bits
                                     are those of the same numbers as doubles */
    size_t position_stride;       /* bytes from one position to the next */
    size_t normal_stride;         /* the same of normals */
    size_t texel_stride;          /* the same of texels */
    const float *face_normals;    /* [count][3], unit, packed: of the faces, where points->normals are smooth.
                                     Directions below the face do not count for AO. NULL: points->normals */
} vsh_point_layout;

static inline vsh_point_layout vsh_point_layout_default(void) {
    vsh_point_layout layout = {sizeof(vsh_point_layout), NULL, 0, 0, 0, NULL};
    return layout;
}

/* Shades points for every light and AO that the output asks for. `layout`: how the points stand in memory;
 * NULL: as vsh_points says. No bit depends on it.
 *
 * Up to 64 points are shaded at once on the calling thread, without allocation, progress or cancelling. More
 * run on run->threads under the stage "query". Where many points do not follow each other in space they are
 * shaded in the order of a curve that fills it (Morton, 1966), as neighbours share proofs and memory, and
 * each value is put in its place: random points then take a fraction of the time. The order is found for
 * VSH_QUERY_BATCH points at a time, which takes 16 bytes for each of them.
 *
 * Values depend neither on that order nor on the other points of a call, by no bit: those of AO, of rays and
 * of shadows by one march, where it ends within max_steps. Shadows by adaptive and exact do within their
 * error, as their rays depend on them (see vsh_points), and so do the deviations of shadows by rays. Nothing
 * depends on threads. Calls for VSH_QUERY_BATCH points each, in turn, and their numbers as `texels`, give
 * every bit of one call for all.
 *
 * Errors (the arrays then hold nothing of use): VSH_ERROR_ARGUMENT (run, size of output or layout, a stride
 * that is none, positions of both kinds, or of neither with a count above 0, a deviation without its values,
 * AO without normals), VSH_ERROR_LIMIT (occluders and order need more than run->memory_limit),
 * VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_query_points(const vsh_query *query, const vsh_points *points,
                                    const vsh_point_layout *layout, const vsh_run *run,
                                    const vsh_query_output *output, vsh_shade_stats *stats, vsh_error *error);

enum { VSH_QUERY_BATCH = 1 << 20 };

#ifdef __cplusplus
}
#endif
#endif
