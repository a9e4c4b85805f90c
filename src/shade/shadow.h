/* Shadow of one light at points: what its estimators (shadow.c) and its rays (shadow_rays.c) share. */
#ifndef VSHI_SHADOW_H
#define VSHI_SHADOW_H

#include "light/view.h"
#include "shade/shade.h"

/* A light as the points of one field see it: what holds for all of them, then a call's kernel and arrays. */
typedef struct vshi_shadow_task {
    const vsh_field *field;
    const vsh_triangles *triangles;   /* of exact methods; else may be NULL */
    const struct vshi_layers *layers; /* beside the field; NULL: none */
    const vsh_light *light;
    const vsh_shade_options *options;
    const vshi_sampler *sampler; /* of rays; else NULL */
    vshi_light_place place;      /* of the light, in field space */
    vshi_light_place world;      /* in world space */
    double lowest;    /* sine of how far below the receiver's plane an axis may be, of its cone's: 1 where the
                       * inner penumbra counts, else 0 */
    bool leaky;       /* exact: what the field has for solid need not be shut off by triangles, so that a cone
                       * which goes into it is not hidden for certain */
    uint32_t purpose; /* of the sampler: lights of other names have other sequences */
    const vshi_kernel *kernel;
    const vsh_points *points;
    bool scattered; /* the points' texels are only numbers: points share no rays */
    float *visibility;
    float *deviation; /* or NULL */
} vshi_shadow_task;

/* Checks the light, and options (resolved ones) for it; fills *task but for sampler, kernel and arrays.
 * Errors: VSH_ERROR_ARGUMENT. */
vsh_result vshi_shadow_prepare(const vsh_occluders *occluders, const vsh_light *light,
                               const vsh_shade_options *options, vshi_shadow_task *task, vsh_error *error);

/* Whether shadows take the task's sampler. */
static inline bool vshi_shadow_has_rays(const vsh_shade_options *options) {
    return (vsh_shadow_method_traits(options->method) & VSH_METHOD_RAYS) != 0;
}

/* Whether they are traced against triangles, by options that may not be settled yet (else NULL will do). */
static inline bool vshi_shadow_traces(const vsh_shade_options *options, const vsh_triangles *triangles) {
    const int32_t method = vsh_shadow_method_resolve(options->method, triangles != NULL);
    return (vsh_shadow_method_traits(method) & VSH_METHOD_TRIANGLES) != 0;
}

/* The most rays that a point takes, by settled options. */
int32_t vshi_shadow_most_rays(const vsh_shade_options *options);

/* Fraction of the light over the receiver's plane at point i, as the task's method sees an edge: 1 without
 * normals. */
double vshi_shadow_above(const vshi_shadow_task *task, size_t i);

/* A vshi_shade_fn of a vshi_shadow_task, at most VSHI_PIECE points at once. */
void vshi_shadow_shade(const void *task, size_t begin, size_t end, vsh_shade_stats *stats);

/* Shadow of one light, prepared for points that come later. It must not be moved, and what it was made of
 * must outlive it. */
typedef struct vshi_shadow_shader {
    vsh_shade_options options; /* settled */
    struct vshi_layers *layers;
    vshi_sampler *sampler;
    vshi_shadow_task task; /* refers to the three above */
} vshi_shadow_shader;

/* Close it also after an error. Errors: as vsh_shade_shadow(). */
vsh_result vshi_shadow_open(const vsh_occluders *occluders, const vsh_light *light,
                            const vsh_shade_options *options, int32_t isa, vshi_shadow_shader *shader,
                            vsh_error *error);
void vshi_shadow_close(vshi_shadow_shader *shader);

/* Shades points on the calling thread; values depend on the points and their order alone. Any thread.
 * `deviation` may be NULL. */
void vshi_shadow_points(const vshi_shadow_shader *shader, const vsh_points *points, float *visibility,
                        float *deviation, vsh_shade_stats *stats);

enum { VSHI_PIECE = 512 }; /* points: with their rays 300 KB of the stack */

/* The points of a piece that the light's cones rise above. */
typedef struct vshi_facing {
    size_t count;
    size_t point[VSHI_PIECE];
    vshi_vec normal[VSHI_PIECE]; /* zero where there are none */
    vshi_cone cone[VSHI_PIECE];  /* horizon: sine of the axis over the receiver's plane, INFINITY without one;
                                  * close, stop: not set */
    bool settled[VSHI_PIECE];    /* no value is left to find */
    bool gathered[VSHI_PIECE];   /* with its neighbours, and not proved: it is likely to be in a penumbra */
} vshi_facing;

/* Gathers points begin … end - 1, at most VSHI_PIECE, without those that are settled already: invalid, within
 * the light, turned away. What blocks of them share is proved (blocks.c). */
void vshi_shadow_gather(const vshi_shadow_task *task, size_t begin, size_t end, vshi_facing *facing,
                        vshi_chunk *chunk, vsh_shade_stats *stats);

/* The value of a point and its deviation. */
static inline void vshi_shadow_settle(const vshi_shadow_task *task, size_t point, float value,
                                      float deviation) {
    task->visibility[point] = value;
    if (task->deviation != NULL) {
        task->deviation[point] = deviation;
    }
}

/* rays, adaptive and exact: a vshi_shade_fn of a vshi_shadow_task. */
void vshi_shadow_by_rays(const void *task, size_t begin, size_t end, vsh_shade_stats *stats);

/* --- proofs that neighbouring points share */

/* Looks at points that follow each other together: one beam around the cones of 64 of them, then of 16, tells
 * that all are hidden, or from where on all are free. Hidden points are done. The cones of free points end
 * there, so only what is near is marched. Points that lie apart lose only the time of the look. */
void vshi_blocks_prove(const vshi_shadow_task *task, vshi_facing *facing, vshi_chunk *chunk,
                       vsh_shade_stats *stats);

/* Points anywhere in each of `count` balls, at most VSHI_CHUNK, of free space: VSHI_PROVED_FREE where all of
 * them see the whole light, VSHI_PROVED_FULL where none sees any of it, else VSHI_UNPROVED. Centres and radii
 * are finest voxels, in field space. */
void vshi_blocks_prove_balls(const vshi_shadow_task *task, size_t count, const vshi_vec *centre,
                             const double *radius, int8_t *proof, vsh_shade_stats *stats);

#endif
