/* Rays against triangles. */
#pragma once

#include "base/job.h"
#include "base/vec.h"
#include "trace/sampler.h"

#include "trace/trace.h"
#include <math.h>
#include <stdbool.h>

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

/* Makes the triangles free their solids with themselves. */
void vshi_triangles_own_solids(vshi_triangles *triangles);

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
