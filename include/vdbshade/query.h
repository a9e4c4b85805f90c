/* Shadow and ambient occlusion at points, asked for again and again: one at a time, or ten million at once.
 */
#ifndef VDBSHADE_QUERY_H
#define VDBSHADE_QUERY_H

#include "shade.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A field, lights and options that are checked and made ready once, so that a call for one point costs little
 * more than its march. Immutable; may be shared by threads. */
typedef struct vsh_query vsh_query;

/* Lights [light_count] (NULL for none: AO only) and options are copied; the field, and options->triangles,
 * must outlive the handle. Free with vsh_query_free(). Errors: VSH_ERROR_ARGUMENT (options out of range, a
 * light that vsh_light_check() refuses, its number in the message, an exact method without triangles: the
 * shadow's only where there are lights), VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_query_create(const vsh_field *field, const vsh_light *lights, size_t light_count,
                                    const vsh_shade_options *options, vsh_query **query, vsh_error *error);
VSH_API void vsh_query_free(vsh_query *query); /* NULL does nothing */

/* Where values go, in the points' order; what is NULL costs nothing. Values are those of vsh_shade_shadow()
 * and vsh_shade_ao(). */
typedef struct vsh_query_output {
    size_t struct_size;
    float *const *visibility; /* [light_count] arrays [count], each or all of them NULL where not asked for */
    float *const *deviation;  /* likewise, of lights whose visibility is asked for */
    float *ao;                /* [count]; needs points->normals */
    float *ao_deviation;      /* [count], with `ao` */
} vsh_query_output;

static inline vsh_query_output vsh_query_output_default(void) {
    vsh_query_output output = {sizeof(vsh_query_output), NULL, NULL, NULL, NULL};
    return output;
}

/* Shades points for every light and AO that the output asks for.
 *
 * Up to 64 points are shaded at once on the calling thread, without allocation, progress or cancelling. More
 * run on run->threads under the stage "query". Where many points do not follow each other in space they are
 * shaded in the order of a curve that fills it (Morton, 1966), as neighbours share proofs and memory, and
 * each value is put in its place: random points then take a fraction of the time. The order is found for up
 * to 4 194 304 points at a time, which takes 16 bytes for each of them.
 *
 * Values do not depend on that order, nor on the other points of a call, but for shadows by adaptive and
 * exact, whose rays depend on it within their error (see vsh_points), as the deviations of shadows by rays
 * do; nothing depends on threads.
 *
 * Errors (the arrays then hold nothing of use): VSH_ERROR_ARGUMENT (run, output's size, a deviation without
 * its values, AO without normals), VSH_ERROR_LIMIT (field and order need more than run->memory_limit),
 * VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_query_points(const vsh_query *query, const vsh_points *points, const vsh_run *run,
                                    const vsh_query_output *output, vsh_shade_stats *stats, vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
