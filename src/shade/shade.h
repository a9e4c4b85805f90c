/* Options, statistics, origins of rays, chunks of cones and errors of rays, for shadow and AO. */
#pragma once

#include "base/parallel.h"
#include "light/light.h"
#include "shade/kernel/march.h"
#include "shade/occluders.h"
#include "trace/sampler.h"

#include <vdbshade/light.h>

/* --- small helpers */

/* Signed distance at a point of field space, voxels. */
static inline double vshi_distance_at(const vsh_field *field, vshi_vec p) {
    const float at[3] = {(float)p.x, (float)p.y, (float)p.z};
    return (double)vshi_field_distance(field, at);
}

/* Unit normal and direction in field space. */
static inline vshi_vec vshi_direction_to_field(const vsh_field *field, vshi_vec direction) {
    return vshi_unit(vshi_transform_vector(field->to_field, direction));
}

/* The group that holds an element. Groups follow each other: first[count + 1] are their first elements. */
size_t vshi_find_group(const size_t *first, size_t count, size_t element);

/* Runs fn for each of `count` elements, one at a time, as a job of its own. Errors: those of fn,
 * VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED, VSH_ERROR_INTERNAL. */
vsh_result vshi_run_stage(const vsh_run *run, const char *stage, size_t count, vshi_element_fn *fn,
                          void *user, vsh_error *error);

/* --- options and statistics */

/* Resolves auto by whether there are triangles. Other methods stay. */
static inline int32_t vshi_shadow_method_resolve(int32_t method, bool has_triangles) {
    const int32_t best = has_triangles ? VSH_SHADOW_EXACT : VSH_SHADOW_ADAPTIVE;
    return method == VSH_SHADOW_AUTO ? best : method;
}
static inline int32_t vshi_ao_method_resolve(int32_t method, bool has_triangles) {
    const int32_t best = has_triangles ? VSH_AO_EXACT : VSH_AO_ADAPTIVE;
    return method == VSH_AO_AUTO ? best : method;
}

/* Tinted visibility, linear RGB, into rgb[count][3]; NaN stays. The tint must have passed vshi_tint_check().
 * Runs on the calling thread. */
void vshi_shade_tint(size_t count, const float *visibility, const vsh_tint *tint, float *rgb);

/* Errors: VSH_ERROR_ARGUMENT (a type or a power out of range). */
vsh_result vshi_tint_check(const vsh_tint *tint, vsh_error *error);

/* Resolves and checks options. Errors: VSH_ERROR_ARGUMENT, naming field, value and limit. */
vsh_result vshi_shade_options_resolve(const vsh_shade_options *options, vsh_shade_options *full,
                                      vsh_error *error);

/* Smallest error that a few rays keep. Their estimates of their own error are rough. */
#define VSHI_COARSE 0.02

/* Resolves auto with `triangles` (NULL: none). Replaces blue noise by Sobol's sequence if methods keep a
 * smaller error than VSHI_COARSE: such values show no grain, and blue noise converges as slowly as white.
 * Layers settle the options for their own triangles. */
void vshi_shade_options_settle(vsh_shade_options *full, const vshi_triangles *triangles);

/* Standard error of a value near a half by a number of rays. */
typedef double vshi_spread_fn(int32_t sampler, int32_t rays);

/* The largest number of rays of a value: as the options say, or for max_error, or a fixed number for methods
 * that keep no error. */
int32_t vshi_shade_most_rays(const vsh_shade_options *options, vshi_spread_fn *spread, bool keeps_error);

/* Squared errors are summed in whole units, so that the order of threads changes no bit. */
#define VSHI_SQUARE_UNIT 0x1p-40

/* Adds the statistics of `more`. */
void vshi_shade_stats_add(vsh_shade_stats *stats, const vsh_shade_stats *more);

/* Shades points begin … end - 1, and adds its work to *stats. */
typedef void vshi_shade_fn(const void *task, size_t begin, size_t end, vsh_shade_stats *stats);

/* Runs fn over `count` points in pieces of `grain`, as a part of a job whose units are points. */
vsh_result vshi_shade_pieces(vshi_job *job, size_t count, size_t grain, vshi_shade_fn *fn, const void *task,
                             vsh_shade_stats *stats, vsh_error *error);

/* Runs fn as a job of its own. `run` is resolved. */
vsh_result vshi_shade_run(const vsh_run *run, const char *stage, size_t count, size_t grain,
                          vshi_shade_fn *fn, const void *task, vsh_shade_stats *stats, vsh_error *error);

/* vsh_shade_irradiance() with tinted visibility. The tint must have passed vshi_tint_check(). */
void vshi_shade_irradiance(const vsh_points *points, const float *shading_normals, const vsh_light *light,
                           const float *visibility, const vsh_tint *tint, float *irradiance);

/* --- where rays begin */

/* Height of the rays' origins above a point, voxels. */
static inline double vshi_shade_offset(const vsh_field *field, const vsh_shade_options *options) {
    return options->start_offset + options->surface_offset / field->voxel_size;
}

/* Finds the origin of point i's rays, `offset` voxels above it, and its unit normal, both in field space.
 * False for a point that is not finite, or has no normal although normals are given (*normal is then zero).
 */
bool vshi_shade_origin(const vsh_field *field, const vsh_points *points, size_t i, double offset,
                       vshi_vec *origin, vshi_vec *normal);

/* The growth of casters for rays that begin at a point of field space, voxels: at most field->grown. */
double vshi_shade_grown(const vsh_field *field, vshi_vec origin);

/* Whether rays from there are traced against the field's surface. It must exist, be grown by no more than
 * vshi_shade_grown(), and the rays must begin outside of it. */
bool vshi_shade_traces(const vsh_field *field, vshi_vec origin);

/* A point on a triangle, world space. Shadow rays begin on the triangle, or are lifted towards the smooth
 * surface that the vertex normals describe (geometry/mesh.h). Then the facets of a smooth mesh do not hide a
 * light above the smooth surface. AO needs no lift: it leaves out the directions below the face. */
typedef struct vshi_lift_point {
    vshi_vec foot;         /* on the triangle */
    vshi_vec lift;         /* from there to the smooth surface */
    vshi_vec face, normal; /* unit: of the triangle, of the smooth surface */
} vshi_lift_point;

/* A light that points are lifted for. */
typedef struct vshi_lifter {
    const vsh_occluders *occluders; /* their triangles limit the lift */
    const vsh_light *light;         /* NULL: AO, which lifts nothing */
    vshi_light_place place;         /* of the light, in world space */
} vshi_lifter;

vshi_lifter vshi_lifter_open(const vsh_occluders *occluders, const vsh_light *light);

/* Whether a part of the light lies below the plane of the point's triangle. */
bool vshi_light_is_cut(const vshi_lifter *lifter, const vshi_lift_point *point);

/* Finds the lift of a point for the light: point->lift times a share from 0 to 1. */
vshi_vec vshi_lift_find(const vshi_lifter *lifter, const vshi_lift_point *point);

/* --- layers beside the field: prepared for a light or for AO, then combined with the field's values
 * (layers.c) */

/* The layers that take part in one light's shadow, or in AO. */
typedef struct vshi_layers vshi_layers;

/* Prepares the layers that cast for `light`, or for AO (NULL), by resolved options. `sphere` is
 * vshi_ao_prepare()'s. *layers is NULL if there are none. Free with vshi_layers_free(). Errors:
 * VSH_ERROR_ARGUMENT, VSH_ERROR_MEMORY. */
vsh_result vshi_layers_prepare(const vsh_occluders *occluders, const vsh_shade_options *options,
                               const vsh_light *light, bool sphere, vshi_layers **layers, vsh_error *error);
void vshi_layers_free(vshi_layers *layers); /* NULL does nothing */

/* --- points in solids or behind walls, by rays against the triangles that bound them (inside.c) */

enum { VSHI_OUTSIDE = 0, VSHI_INSIDE = 1 };

/* A field that finds points in the open: those at least `least` away from all casters. */
typedef struct vshi_open_field {
    const vsh_field *field;
    const vshi_vec *at; /* [points]: near them, field space */
    double least;       /* world units */
} vshi_open_field;

/* Tests `count` points [count][3] on surfaces, a hair above them along their normals [count][3] (unit, or
 * zero for any direction). Writes where[count]. `open`, which may be NULL, decides where a few rays leave
 * doubt. follows[count]: whether a point is next to the one before it on a surface. The two then share a
 * result unless a triangle parts them. NULL: each result depends on its point alone. Thread safe. */
void vshi_inside(const vshi_triangles *triangles, size_t count, const double *positions, const float *normals,
                 const bool *follows, const vshi_open_field *open, uint8_t *where);

/* --- chunks of cones: set up in double precision, marched, read back */

/* A cone in field space. */
typedef struct vshi_cone {
    vshi_vec origin;
    vshi_vec direction; /* unit */
    double begin;       /* the cone is free up to here; 0: nothing is known */
    double end;         /* the cone is free from here on; may be infinite, or before `begin` */
    double whole;       /* of shadows: the end before anything was proved; else 0 */
    double sine;        /* of the half angle; 0: a ray */
    double close;       /* upper bound of its closeness: at most `sine`; 1 for rays */
    double stop;
    double horizon; /* of proofs: see vshi_chunk */
    double wide;    /* of beams: radius at the origin; else 0 */
    double deeper;  /* of beams: see vshi_chunk; else 0 */
} vshi_cone;

/* Adds a cone if it can meet the casters' bounds, else returns false: the cone is free. If the field is
 * unknown, returns true and adds nothing: the cone stays open. */
bool vshi_chunk_add(vshi_chunk *chunk, const vsh_field *field, const vshi_cone *cone, uint32_t owner,
                    vsh_shade_stats *stats);

/* Marches a chunk's rays, VSHI_MARCH_…, and counts the work. An unfinished proof proves nothing, so it does
 * not count as unfinished. */
void vshi_chunk_march(vshi_chunk *chunk, const vshi_kernel *kernel, const vsh_field *field, int32_t kind,
                      int32_t max_steps, vsh_shade_stats *stats);

/* Visible fraction of a cone by its sine and closeness (h / t). The closeness is the sine of the angle
 * between the axis and the occluder's edge. The tangents of both angles are the disc's radius and the edge's
 * offset. */
double vshi_cone_visibility(double closeness, double sine);

/* --- errors of rays */

/* Standard error that an edge across the disc leaves in the share of lit rays: c sqrt(p (1 - p)) n^-3/4, for
 * white noise n^-1/2, measured over edges of all places and directions (test_sampler). `lit` of `taken` rays
 * were lit, and the share was `expected` (a half if unknown). */
double vshi_rays_deviation(int32_t sampler, int32_t lit, int32_t taken, double expected);

/* Standard error of the share of lit rays, with the rays of the points around. An edge across the disc cuts
 * as many of the rays' cells as its chord is long. Towards the rim the chord shrinks more slowly than the
 * part beyond it. So the variance is c (p (1 - p))^1/3 n^-3/2 (test_sampler), or the binomial's
 * p (1 - p) / n if that is less. If all rays agree, the error is what they may have missed. */
double vshi_rays_error(int32_t sampler, int32_t lit, int32_t taken, double lit_around, double taken_around);

/* Factor on errors that use the neighbours' share in place of the point's. Measured on the seeds' floor,
 * where the estimate is then right to a tenth. */
#define VSHI_BORROWED 1.2
