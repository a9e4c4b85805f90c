/* Shadow of one light at points: the data that one-march methods (shadow.c), rays (shadow_rays.c), proofs
 * (blocks.c) and interpolation (interpolation.c) share. */
#pragma once

#include "light/light.h"
#include "shade/shade.h"

/* A light as the points of one field see it, then the kernel and arrays of a call. */
typedef struct vshi_shadow_task {
    const vsh_field *field;
    const vshi_triangles *triangles; /* of exact methods; else may be NULL */
    vshi_layers *layers;             /* layers beside the field; NULL: none */
    const vsh_light *light;
    vsh_shade_options options; /* settled */
    vshi_sampler *sampler;     /* of methods by rays; else NULL */
    vshi_light_place place;    /* of the light, in field space */
    vshi_light_place world;    /* of the light, in world space */
    double lowest;    /* the lowest axis below the receiver's plane, in sines of its cone: 1 if the inner
                         penumbra counts, else 0 */
    bool leaky;       /* exact: triangles need not close off the field's solids, so a cone that enters one may
                       * still see light */
    uint32_t purpose; /* of the sampler: lights of other names have other sequences */
    const vshi_kernel *kernel;
    const vsh_points *points;
    const double *places; /* [points][3]: whether the light reaches a point is decided here, world units;
                             NULL: at the points */
    bool scattered;       /* the points' texels are only numbers: points share no rays */
    float *visibility;
    float *deviation; /* or NULL */
} vshi_shadow_task;

/* Checks the light, settles and checks resolved options. Fills *task but for layers, kernel and arrays. Close
 * the task even after an error. Errors: VSH_ERROR_ARGUMENT, VSH_ERROR_MEMORY. */
vsh_result vshi_shadow_prepare(const vsh_occluders *occluders, const vsh_light *light,
                               const vsh_shade_options *options, vshi_shadow_task *task, vsh_error *error);

static inline bool vshi_shadow_has_rays(const vsh_shade_options *options) {
    return (vsh_method_traits(VSH_NAMES_SHADOW, options->method) & VSH_METHOD_RAYS) != 0;
}

/* Whether shadows are traced against triangles (NULL: there are none). The options may be unsettled. */
static inline bool vshi_shadow_traces(const vsh_shade_options *options, const vshi_triangles *triangles) {
    const int32_t method = vshi_shadow_method_resolve(options->method, triangles != NULL);
    return (vsh_method_traits(VSH_NAMES_SHADOW, method) & VSH_METHOD_TRIANGLES) != 0;
}

/* The largest number of rays of a point, by settled options. */
int32_t vshi_shadow_most_rays(const vsh_shade_options *options);

/* Fraction of the light above the receiver's plane at point i, as the task's method sees an edge: 1 without
 * normals. */
double vshi_shadow_above(const vshi_shadow_task *task, size_t i);

/* Whether point i is within the light's reach and cone. */
static inline bool vshi_shadow_reaches(const vshi_shadow_task *task, size_t i) {
    const double *places = task->places != NULL ? task->places : task->points->positions;
    return vshi_light_lights(&task->world, vshi_vec_of(places + 3 * i));
}

/* A vshi_shade_fn of a vshi_shadow_task, for at most VSHI_PIECE points. */
vshi_shade_fn vshi_shadow_shade;

/* Prepares the shadow of one light for later points. Occluders and light must outlive the task. Close it even
 * after an error. Errors: as vsh_shade_shadow(). */
vsh_result vshi_shadow_open(const vsh_occluders *occluders, const vsh_light *light,
                            const vsh_shade_options *options, int32_t isa, vshi_shadow_task *task,
                            vsh_error *error);
void vshi_shadow_close(vshi_shadow_task *task);

/* Shades points on the calling thread. Values depend only on the points and their order. Thread safe.
 * `places` is as in the task; `deviation` may be NULL. */
void vshi_shadow_points(const vshi_shadow_task *prepared, const vsh_points *points, const double *places,
                        float *visibility, float *deviation, vsh_shade_stats *stats);

enum { VSHI_PIECE = 512 }; /* points: with their rays 300 KB of the stack */

/* The points of a piece that face the light. */
typedef struct vshi_facing {
    size_t count;
    size_t point[VSHI_PIECE];
    vshi_vec normal[VSHI_PIECE]; /* zero without normals */
    vshi_cone cone[VSHI_PIECE];  /* horizon: sine of the axis over the receiver's plane, INFINITY without one;
                                  * close, stop: not set */
    bool settled[VSHI_PIECE];    /* the value is known */
    bool gathered[VSHI_PIECE];   /* its block was marched, and not proved: it is likely to be in a penumbra */
} vshi_facing;

/* Gathers points begin … end - 1, at most VSHI_PIECE. Settles invalid points, points within the light, points
 * that face away, and points beyond its reach or cone. Proves blocks of the others. */
void vshi_shadow_gather(const vshi_shadow_task *task, size_t begin, size_t end, vshi_facing *facing,
                        vshi_chunk *chunk, vsh_shade_stats *stats);

/* Sets the value of a point and its deviation. */
static inline void vshi_shadow_settle(const vshi_shadow_task *task, size_t point, float value,
                                      float deviation) {
    task->visibility[point] = value;
    if (task->deviation != NULL) {
        task->deviation[point] = deviation;
    }
}

/* Shades by rays, adaptive and exact. */
void vshi_shadow_by_rays(const vshi_shadow_task *task, size_t begin, size_t end, vsh_shade_stats *stats);

/* Combines the layers with the values of points begin … end - 1 in the task's arrays, at most VSHI_PIECE
 * points. */
void vshi_layers_shadow(const vshi_layers *layers, const vshi_shadow_task *task, size_t begin, size_t end,
                        vsh_shade_stats *stats);

/* --- proofs that neighbouring points share (blocks.c) */

/* Marches one beam around the cones of 64 points that follow each other, then of 16 and 4. It proves that all
 * are hidden, or free from some distance on. Hidden points are settled, and the cones of free points end
 * there. Points that lie apart only lose time. */
void vshi_blocks_prove(const vshi_shadow_task *task, vshi_facing *facing, vshi_chunk *chunk,
                       vsh_shade_stats *stats);

/* Proves `count` balls of free space, at most VSHI_CHUNK: VSHI_PROVED_FREE if all points of a ball see the
 * whole light, VSHI_PROVED_FULL if no point sees any of it or the light reaches none, else VSHI_UNPROVED.
 * Centres and radii are finest voxels, in field space. */
void vshi_blocks_prove_balls(const vshi_shadow_task *task, size_t count, const vshi_vec *centre,
                             const double *radius, int8_t *proof, vsh_shade_stats *stats);

/* --- texels that share rays (interpolation.c): where light changes little, some texels of a square get rays
 * and the others are interpolated */

enum {
    VSHI_INTERPOLATION_GONE,
    VSHI_INTERPOLATION_KNOWN,
    VSHI_INTERPOLATION_OPEN,
    VSHI_INTERPOLATION_WANTED
};

/* Points of a piece, by their place in it. */
typedef struct vshi_interpolation {
    const vsh_points *points;
    size_t begin, count;
    double max_error; /* standard error that a value may have */
    int32_t sampler;  /* VSH_SAMPLER_… of the rays */
    /* rays that every open point gets first. They show details narrower than the steps between anchors */
    int32_t rays;
    uint16_t lit[VSHI_PIECE]; /* of these rays */
    uint8_t state[VSHI_PIECE];
    float value[VSHI_PIECE], deviation[VSHI_PIECE]; /* of known points */
    /* runs of points in the same square of 8 × 8 texels */
    size_t runs;
    uint16_t run_begin[VSHI_PIECE + 1];
} vshi_interpolation;

enum { VSHI_INTERPOLATION_LEVELS = 2 }; /* squares of 8 × 8 texels, then of 4 × 4 */

/* The number of first rays: 4 to 256, a small part of all rays. */
int32_t vshi_interpolation_rays(double max_error);

/* Finds the squares. The states must be set. */
void vshi_interpolation_begin(vshi_interpolation *interp);

/* Marks the anchors of the level's squares, open points that the others are interpolated from, as
 * VSHI_INTERPOLATION_WANTED. False if there are none. */
bool vshi_interpolation_pick(vshi_interpolation *interp, int level);

/* Interpolates the open points of a square once its anchors are known, if the anchors agree with each other
 * to within their errors, and with the open points' own rays. These points are then known too. */
void vshi_interpolation_fill(vshi_interpolation *interp, int level);
