/* Rays against triangles (Embree) and procedural solids, and values at points by such rays. */
#pragma once

#include "base/job.h"
#include "light/light.h"
#include "trace/sampler.h"

#include <math.h>
#include <stdbool.h>

/* --- solids; rays and cones against them are thread safe */

/* Procedural casters as they are: no voxels, no triangles. Immutable; may be shared by threads. */
typedef struct vshi_solids vshi_solids;

/* Copies `count` trees, each under its transform (transforms: [count][12], local to world, three rows of
 * four). Errors: VSH_ERROR_INPUT (as vshi_sdf_check(); a transform that shears or scales unevenly),
 * VSH_ERROR_MEMORY. Free the result with vshi_solids_free(). */
vsh_result vshi_solids_create(const vsh_sdf *sdfs, const double *transforms, size_t count,
                              vshi_solids **solids, vsh_error *error);
void vshi_solids_free(vshi_solids *solids); /* NULL does nothing */

/* Signed distance to the nearest solid, as vshi_sdf_distance(), world units; infinite where there is none. */
double vshi_solids_distance(const vshi_solids *solids, const double position[3]);

/* The solids are the union of parts. A part's world box has low > high if it is empty. */
size_t vshi_solids_part_count(const vshi_solids *solids);
void vshi_solids_part_box(const vshi_solids *solids, size_t part, double low[3], double high[3]);

/* The distance at which a ray (unit direction to within 1e-6) meets a part; infinite if it does not. */
double vshi_solids_part_meet(const vshi_solids *solids, size_t part, const vshi_segment_ray *ray);

/* Sets blocked[i] if ray i meets a solid. Skips rays whose blocked[i] is set already. */
void vshi_solids_blocked(const vshi_solids *solids, const vshi_segment_ray *rays, size_t count,
                         bool *blocked);

typedef enum vshi_cone_state {
    VSHI_CONE_UNKNOWN,
    VSHI_CONE_FREE,   /* no ray of the cone meets a solid */
    VSHI_CONE_COVERED /* every ray does */
} vshi_cone_state;

/* Proves a state of all rays from `origin` within `tangent` of the unit `axis`. The rays end at depths along
 * the axis between `near` and `far`. */
vshi_cone_state vshi_solids_cone(const vshi_solids *solids, const double origin[3], const double axis[3],
                                 double tangent, double near, double far);

/* --- triangles */

/* The triangles of some meshes in world space, in a tree for rays. Immutable; may be shared by threads. */
typedef struct vshi_triangles vshi_triangles;

/* Copies the meshes' triangles, transforms applied; both sides of a triangle block. `solids`, which may be
 * NULL, are part of the scene. The result owns them, but not after an error. `run` is resolved. The first
 * call loads Embree, which stays loaded. Errors: VSH_ERROR_UNSUPPORTED (Embree cannot be loaded),
 * VSH_ERROR_INPUT (as vsh_mesh_check()), VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. Free the
 * result with vshi_triangles_free(). */
vsh_result vshi_triangles_create(const vsh_mesh *meshes, size_t mesh_count, vshi_solids *solids,
                                 const vsh_run *run, vshi_triangles **triangles, vsh_error *error);
void vshi_triangles_free(vshi_triangles *triangles); /* NULL does nothing */

/* Bytes in memory. Cannot fail. */
uint64_t vshi_triangles_bytes(const vshi_triangles *triangles);

/* Quads in their own space, within a box. A triangle is a quad whose last two corners are the same. */
typedef struct vshi_quads {
    size_t corner_count, quad_count;
    double low[3], high[3];
    /* Writes corners[corner_count][3], moved by -centre and then scaled, and quads[quad_count][4]. */
    vsh_result (*write)(void *user, const double centre[3], double scale, float *corners, uint32_t *quads,
                        vsh_error *error);
    void *user;
} vshi_quads;

/* Makes triangles for vshi_triangles_blocked() only. `held` bytes are in use. Errors: as
 * vshi_triangles_create(), and of `write`. */
vsh_result vshi_triangles_of_quads(const vshi_quads *quads, const vsh_run *run, double held, vshi_job *job,
                                   vshi_triangles **triangles, vsh_error *error);

/* Whether each of `count` rays meets a triangle. Thread safe. */
void vshi_triangles_blocked(const vshi_triangles *triangles, const vshi_segment_ray *rays, size_t count,
                            bool *blocked);

/* The same for the backs of triangles only: rays pass fronts. */
void vshi_triangles_meet_backs(const vshi_triangles *triangles, const vshi_segment_ray *rays, size_t count,
                               bool *met);

/* Distance to the first triangle that a ray meets; ray->far if it meets none. Thread safe. */
double vshi_triangles_distance(const vshi_triangles *triangles, const vshi_segment_ray *ray);

/* A face and a smooth normal with a greater cosine (less than 0.08 degrees) count as equal: rounding of
 * floats. */
#define VSHI_ONE_NORMAL (1.0 - 1e-6)

/* A plane through the centre of a dome, which limits its directions. `rise` is the cosine between the plane's
 * normal and the dome's axis. (x, y) is the unit direction on the disc towards which the normal leans. */
typedef struct vshi_lean {
    double rise, x, y;
} vshi_lean;

static const vshi_lean VSHI_WHOLE_DOME = {1.0, 1.0, 0.0};

/* How the plane with the normal `up` limits the dome over axes[2]. All vectors are unit. */
static inline vshi_lean vshi_dome_lean(vshi_vec up, const vshi_vec axes[3]) {
    static const double STRAIGHT = 1e-12; /* square of a sine below which any direction will do */
    const double x = vshi_dot(up, axes[0]), y = vshi_dot(up, axes[1]), rise = vshi_dot(up, axes[2]);
    const double square = x * x + y * y, unit = square > STRAIGHT ? 1.0 / sqrt(square) : 0.0;
    return (vshi_lean){rise < -1.0 ? -1.0 : rise > 1.0 ? 1.0 : rise, unit > 0.0 ? unit * x : 1.0, unit * y};
}

/* Moves a place on the disc to where its direction on the dome (Malley) lies above the plane. The disc then
 * begins at half an ellipse. All rows along the lean shrink by the same factor, which keeps areas in
 * proportion. */
static inline void vshi_dome_place(const vshi_lean *lean, double place[2]) {
    if (lean->rise < 1.0) {
        const double along = place[0] * lean->x + place[1] * lean->y;
        const double edge = 1.0 - (place[0] * place[0] + place[1] * place[1]) + along * along;
        const double to = (1.0 + lean->rise) * along + (1.0 - lean->rise) * sqrt(edge > 0.0 ? edge : 0.0);
        const double by = 0.5 * to - along;
        place[0] += by * lean->x;
        place[1] += by * lean->y;
    }
}

/* A disc that a point sees, or a dome over one. World space. */
typedef struct vshi_disc {
    double origin[3];
    vshi_vec axis, u, v; /* for (x, y) on the unit disc, rays go along axis + x u + y v; on a dome along
                            √(1 - x² - y²) axis + x u + y v, with three unit vectors */
    vshi_lean lean;      /* of a dome */
    vshi_vec normal;     /* rays below this horizon count as blocked; zero: no horizon */
    double far;          /* length of the rays; may be infinite */
    uint32_t shift[2];   /* of the texel: vshi_sampler_shift() */
} vshi_disc;

/* Mirrors a direction below a face at that face. A zero normal is no face. */
static inline vshi_vec vshi_dome_mirror(vshi_vec d, vshi_vec face) {
    const double below = vshi_dot(d, face);
    return below < 0.0 ? vshi_sub(d, vshi_scale(face, 2.0 * below)) : d;
}

/* Whether a point is near enough to the triangles for vshi_triangles_discs(). */
bool vshi_triangles_sees(const vshi_triangles *triangles, const double origin[3]);

/* Adds to lit[count] the number of rays first … last - 1 of each disc, or (`domes`) of each dome, that meet
 * nothing. The rays are whole blocks of a VSH_SAMPLER_SOBOL (vshi_sampler_is_blocks()). Successive discs
 * should be near each other. Thread safe. */
void vshi_triangles_discs(const vshi_triangles *triangles, const vshi_sampler *sampler, bool domes,
                          const vshi_disc *discs, size_t count, int32_t first, int32_t last, int32_t *lit);

/* The first side that a ray meets, except for sheets, which have air on both sides. */
enum {
    VSHI_MEETS_NOTHING,
    VSHI_MEETS_AIR,   /* the visible side of a solid or wall */
    VSHI_MEETS_SOLID, /* the inner side: the ray begins in a solid, or behind a wall */
    VSHI_MEETS_HOLED, /* the inner side of a solid with holes: the ray may begin outside */
    VSHI_MEETS_COUNT
};
void vshi_triangles_meet(const vshi_triangles *triangles, const vshi_segment_ray *rays, size_t count,
                         uint8_t *meets);

/* Whether the first side of a solid or vessel that a ray meets is an inner one. */
bool vshi_triangles_meet_inner(const vshi_triangles *triangles, const vshi_segment_ray *ray);

/* Counts the solids around a ray's origin: the most that it has left more often than entered. This is right
 * for nested solids, too. Walls count as solids behind their faces. */
int vshi_triangles_depth(const vshi_triangles *triangles, const vshi_segment_ray *ray);

/* Whether any triangle is a solid's or a wall's. */
bool vshi_triangles_have_solids(const vshi_triangles *triangles);

/* Whether any solid or wall has holes, by which rays go in and out. */
bool vshi_triangles_have_holes(const vshi_triangles *triangles);

/* Whether any sheet is a vessel (geometry/solidity.h). */
bool vshi_triangles_have_vessels(const vshi_triangles *triangles);

/* The box around all triangles, world space; low > high if there are none. */
void vshi_triangles_bounds(const vshi_triangles *triangles, double low[3], double high[3]);

/* Distance from surfaces at which rays begin, world units: above the rounding of floats, too small to see. */
double vshi_triangles_offset(const vshi_triangles *triangles);

/* --- values at single points by rays against the casters themselves, without a field (trace.c) */

/* First rays of each set of a point. If they agree with the expected value, the point shoots no more. */
enum { VSHI_TRUTH_FIRST = 16 };

typedef struct vshi_truth {
    const vshi_triangles *triangles; /* one of these may be NULL */
    const vshi_solids *solids;
    const vsh_light *light; /* NULL: AO */
    vshi_light_place place; /* of the light, in world space */
    double distance;        /* of AO */
    const vshi_vec *up;     /* of AO: over this horizon alone; NULL: none */
    double offset;          /* of rays' origins along the normal, world units */
    const vshi_sampler *sampler;
    int32_t rays; /* most rays of each set of a point; the sampler has as many */
} vshi_truth;

/* Whether the first rays of both sets were all hidden, or all free. */
enum { VSHI_TRUTH_EVEN_HIDDEN = -1, VSHI_TRUTH_UNEVEN = 0, VSHI_TRUTH_EVEN_FREE = 1 };

/* vshi_truth_twice() before the expected value is known: counts the free rays of both full sets. *even:
 * VSHI_TRUTH_… of the first rays. */
bool vshi_truth_count(const vshi_truth *truth, const double position[3], const float normal[3],
                      const float *face, uint32_t texel, int32_t free[2], int32_t *even);

/* The result of vshi_truth_twice(), from the counts of vshi_truth_count(). */
void vshi_truth_settle(int32_t rays, const int32_t free[2], int32_t even, double expected, double seen[2]);

/* The value at a point, by two sets of rays, independent of each other and of shading's rays. On average (f -
 * seen[0]) (f - seen[1]) is the squared error of f, without the error of these rays. Returns false if there
 * is no value: no normal, or a position that is not finite. Thread safe. */
bool vshi_truth_twice(const vshi_truth *truth, const double position[3], const float normal[3],
                      const float *face, uint32_t texel, double expected, double seen[2]);
