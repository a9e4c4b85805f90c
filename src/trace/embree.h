/* Rays against triangles. */
#ifndef VSHI_EMBREE_H
#define VSHI_EMBREE_H

#include "base/job.h"
#include "base/vec.h"
#include "trace/sampler.h"

#include <math.h>
#include <stdbool.h>
#include <vdbshade/trace.h>

/* Quads in a space of their own, within a box. A triangle's last two corners are one. */
typedef struct vshi_quads {
    size_t corner_count, quad_count;
    double low[3], high[3];
    /* Writes corners[corner_count][3], moved by -centre and then scaled, and quads[quad_count][4]. Called
     * once. */
    vsh_result (*write)(void *user, const double centre[3], double scale, float *corners, uint32_t *quads,
                        vsh_error *error);
    void *user;
} vshi_quads;

/* Makes what vshi_triangles_blocked() is asked of, and nothing else. `held`: bytes that are taken beside.
 * Errors: as vsh_triangles_create(), and those of `write`. */
vsh_result vshi_triangles_of_quads(const vshi_quads *quads, const vsh_run *run, double held, vshi_job *job,
                                   vsh_triangles **triangles, vsh_error *error);

/* Frees the solids that the triangles were created beside together with them. */
void vshi_triangles_own_solids(vsh_triangles *triangles);

/* Whether each of `count` rays meets a triangle. Thread safe. */
void vshi_triangles_blocked(const vsh_triangles *triangles, const vshi_segment_ray *rays, size_t count,
                            bool *blocked);

/* The same for the backs of triangles only: rays pass fronts by. */
void vshi_triangles_meet_backs(const vsh_triangles *triangles, const vshi_segment_ray *rays, size_t count,
                               bool *met);

/* Distance to the first triangle that a ray meets; ray->far where it meets none. Thread safe. */
double vshi_triangles_distance(const vsh_triangles *triangles, const vshi_segment_ray *ray);

/* A face and a smooth normal that lean apart by less (0.08 degrees) are one: rounding of floats. */
#define VSHI_ONE_NORMAL (1.0 - 1e-6)

/* A plane through the centre of a dome, which limits its directions. `rise` is the cosine between the plane's
 * normal and the dome's axis, (x, y) the unit direction on the disc that the normal leans to. */
typedef struct vshi_lean {
    double rise, x, y;
} vshi_lean;

static const vshi_lean VSHI_WHOLE_DOME = {1.0, 1.0, 0.0};

/* How the plane with the normal `up` limits the dome over axes[2]. All vectors are unit. */
static inline vshi_lean vshi_dome_lean(vshi_vec up, const vshi_vec axes[3]) {
    static const double STRAIGHT = 1e-12; /* square of a sine: the direction may then be any */
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
    vshi_vec axis, u, v; /* a ray goes along axis + x u + y v, (x, y) on the unit disc; of a dome, where all
                            three are unit, along √(1 - x² - y²) axis + x u + y v */
    vshi_lean lean;      /* of a dome */
    vshi_vec normal;     /* rays below it meet something, whatever there is; zero: none do */
    double far;          /* how long the rays are; may be infinite */
    uint32_t shift[2];   /* of the texel: vshi_sampler_shift() */
} vshi_disc;

/* A direction below a face, mirrored at it; others, and of a zero normal all, stay. */
static inline vshi_vec vshi_dome_mirror(vshi_vec d, vshi_vec face) {
    const double below = vshi_dot(d, face);
    return below < 0.0 ? vshi_sub(d, vshi_scale(face, 2.0 * below)) : d;
}

/* Whether a point is near enough to the triangles for vshi_triangles_discs(). */
bool vshi_triangles_sees(const vsh_triangles *triangles, const double origin[3]);

/* Adds to lit[count] how many of the rays first … last - 1 of each disc, or (`domes`) of each dome, meet
 * nothing: whole blocks of a VSH_SAMPLER_SOBOL (vshi_sampler_is_blocks()). Those that follow each other are
 * best near each other. Thread safe. */
void vshi_triangles_discs(const vsh_triangles *triangles, const vshi_sampler *sampler, bool domes,
                          const vshi_disc *discs, size_t count, int32_t first, int32_t last, int32_t *lit);

/* What a ray meets first that is no sheet: those have air on both sides. */
enum {
    VSHI_MEETS_NOTHING,
    VSHI_MEETS_AIR,   /* the side of a solid, or of a wall, that is to be seen */
    VSHI_MEETS_SOLID, /* the other one: the ray begins in a solid, or behind a wall */
    VSHI_MEETS_HOLED, /* the other one of a solid with holes: so it seems */
    VSHI_MEETS_COUNT
};
void vshi_triangles_meet(const vsh_triangles *triangles, const vshi_segment_ray *rays, size_t count,
                         uint8_t *meets);

/* Whether the first side of a solid or of a vessel that a ray meets is an inner one. */
bool vshi_triangles_meet_inner(const vsh_triangles *triangles, const vshi_segment_ray *ray);

/* How many solids hold the origin of a ray, by what it crosses on its way: the most that it leaves before it
 * enters as many. Also right where solids lie in each other. Walls count as solids behind them. */
int vshi_triangles_depth(const vsh_triangles *triangles, const vshi_segment_ray *ray);

/* Whether any triangle is a solid's or a wall's. */
bool vshi_triangles_have_solids(const vsh_triangles *triangles);

/* Whether any solid or wall has holes, by which rays go in and out. */
bool vshi_triangles_have_holes(const vsh_triangles *triangles);

/* Whether any sheet is a vessel (mesh/solidity.h). */
bool vshi_triangles_have_vessels(const vsh_triangles *triangles);

/* The box around all triangles, world space; min > max where there are none. */
void vshi_triangles_bounds(const vsh_triangles *triangles, double low[3], double high[3]);

/* How far off a surface rays begin, world units: above the rounding of floats, below what shows. */
double vshi_triangles_lift(const vsh_triangles *triangles);

#endif
