/* What casts in closed form, of shadow and of AO: an edge, a corner, a slit, a disc; and how much is seen
 * beside it. For the tests of what is claimed of errors. */
#ifndef TESTS_CLAIMED_H
#define TESTS_CLAIMED_H

#include "shading.h"
#include "texels_of.h"

#include "truth/directions.h"

#include <vdbshade/trace.h>

enum { EDGE, CORNER, SLIT, DISC, SHAPES };
static const char *const NAMES[SHAPES] = {"edge", "corner", "slit", "disc"};

enum { ROUND = 1024 };

/* Half angle of the sun as a tangent, */
static double WIDE = 0.25;
/* height and thickness of what casts, AO distance. */
static const double HEIGHT = 1.0, THICK = 0.5, DISTANCE = 1.0;
/* Half the slit, the disc's radius. */
static const double GAP = 0.125, RADIUS = 0.15;

typedef struct stage {
    int shape;
    bool ao;
    float positions[3][3 * (ROUND + 1)];
    uint32_t indices[3 * ROUND];
    vsh_mesh meshes[2];
    size_t mesh_count;
    vsh_field *field;
    vsh_triangles *triangles;
} stage;

static inline void make_box(stage *s, const double low[3], const double high[3]) {
    static const uint32_t SIDES[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                       2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    float *p = s->positions[s->mesh_count];
    for (size_t v = 0; v < 8; ++v) {
        for (size_t axis = 0; axis < 3; ++axis) {
            p[3 * v + axis] = (float)(v >> axis & 1 ? high[axis] : low[axis]);
        }
    }
    s->meshes[s->mesh_count++] =
        (vsh_mesh){.name = "box", .positions = p, .indices = SIDES, .vertex_count = 8, .triangle_count = 12};
}

/* A flat disc, a fan of as large an area as the circle's. */
static inline void make_disc(stage *s, double height, double radius) {
    float *p = s->positions[0];
    const double a = 2.0 * PI / ROUND, out = radius * sqrt(a / sin(a));
    p[0] = p[2] = 0.0f;
    p[1] = (float)height;
    for (uint32_t k = 0; k < ROUND; ++k) {
        p[3 * k + 3] = (float)(out * cos(a * k));
        p[3 * k + 4] = (float)height;
        p[3 * k + 5] = (float)(out * sin(a * k));
        s->indices[3 * k] = 0;
        s->indices[3 * k + 1] = k + 1;
        s->indices[3 * k + 2] = (k + 1) % ROUND + 1;
    }
    s->meshes[s->mesh_count++] = (vsh_mesh){.name = "disc",
                                            .positions = p,
                                            .indices = s->indices,
                                            .vertex_count = ROUND + 1,
                                            .triangle_count = ROUND};
}

/* Boxes whose faces lie on planes of the lattice, where a field of them is exact; shadows fall on y = 0.
 * Walls for AO stand in it. */
static inline stage *make_stage(int shape, bool ao, double voxel) {
    stage *s = calloc(1, sizeof *s);
    assert_non_null(s);
    s->shape = shape;
    s->ao = ao;
    const double y0 = ao ? -0.5 : HEIGHT, y1 = ao ? 1.5 : HEIGHT + THICK, far = 2.0;
    const double all[2][3] = {{-far, y0, -far}, {far, y1, far}};
    if (shape == DISC) {
        make_disc(s, HEIGHT, ao ? 4.0 * RADIUS : RADIUS);
    } else if (shape == CORNER && !ao) {
        make_box(s, (double[]){0.0, y0, 0.0}, all[1]);
    } else {
        make_box(s, (double[]){shape == SLIT && !ao ? GAP : 0.0, y0, -far}, all[1]);
        if (shape == SLIT) {
            make_box(s, all[0], (double[]){ao ? -1.5 : -GAP, y1, far});
        }
        if (shape == CORNER) {
            make_box(s, (double[]){-far, y0, 0.0}, all[1]);
        }
    }
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = voxel;
    vsh_grid *grid = NULL;
    vsh_error error = {0};
    if (vsh_grid_from_meshes(s->meshes, s->mesh_count, &options, NULL, &grid, &error) != VSH_OK ||
        vsh_field_create(grid, NULL, NULL, &s->field, &error) != VSH_OK ||
        (vsh_triangles_available() &&
         vsh_triangles_create(s->meshes, s->mesh_count, NULL, &s->triangles, &error) != VSH_OK)) {
        fail_msg("%s", error.message);
    }
    vsh_grid_free(grid);
    return s;
}

static inline void free_stage(stage *s) {
    vsh_triangles_free(s->triangles);
    vsh_field_free(s->field);
    free(s);
}

/* --- closed forms: shares of a unit disc */

/* Where x < a and y < b. */
static inline double below_both(double a, double b) {
    if (a <= -1.0 || b <= -1.0) {
        return 0.0;
    }
    if (a >= 1.0 || b >= 1.0) {
        return a >= 1.0 ? b >= 1.0 ? 1.0 : truth_disc_share(b) : truth_disc_share(a);
    }
    if (a * a + b * b >= 1.0) { /* the corner is outside the disc */
        return a > 0.0 && b > 0.0 ? truth_disc_share(a) + truth_disc_share(b) - 1.0
               : a > 0.0          ? truth_disc_share(b)
               : b > 0.0          ? truth_disc_share(a)
                                  : 0.0;
    }
    /* half of each part that the lines through the corner cut off, and the rest by the corner's rectangle:
     * d²/da db of the share is 1 / π in the disc */
    return 0.5 * (truth_disc_share(a) + truth_disc_share(b)) - 0.25 + a * b / PI;
}

/* Where circles of radius 1 and r, so far apart, overlap. */
static inline double overlap(double r, double apart) {
    if (apart >= 1.0 + r) {
        return 0.0;
    }
    if (apart <= fabs(1.0 - r)) {
        return r < 1.0 ? r * r : 1.0;
    }
    const double x = (apart * apart + 1.0 - r * r) / (2.0 * apart), y = apart - x;
    const double h = sqrt(fmax(0.0, 1.0 - x * x));
    return (acos(x) - x * h + r * r * acos(fmin(1.0, fmax(-1.0, y / r))) - y * h) / PI;
}

/* How far a face at `off` hides the light, in radii of its disc: by its upper edge where it stands beside the
 * receiver, by its lower one where it is above it. */
static inline double limit(double off) {
    return off / (off > 0.0 ? HEIGHT + THICK : HEIGHT) / WIDE;
}

/* The corner's edges, seen from beside one and under the other, hide what lies between their ends: the part
 * of each line of the disc is known. */
static inline double beside_corner(double x, double z) {
    enum { LINES = 4000 };
    double hidden = 0.0;
    for (int k = 0; k < LINES; ++k) {
        const double angle = PI * ((k + 0.5) / LINES - 0.5), v = sin(angle), half = cos(angle);
        /* heights at which the line is behind the corner's edge along x */
        const double rise = WIDE * v;
        double low = HEIGHT, high = HEIGHT + THICK;
        if (z + low * rise <= 0.0 && z + high * rise <= 0.0) {
            continue;
        }
        if (z + low * rise <= 0.0) {
            low = -z / rise;
        } else if (z + high * rise <= 0.0) {
            high = -z / rise;
        }
        const double least = fmin(-x / low, -x / high) / WIDE;
        const double from = fmax(least, -half);
        hidden += from < half ? (half - from) * half : 0.0;
    }
    return 1.0 - hidden / LINES;
}

static inline double shadow_truth(const stage *s, double x, double z) {
    switch (s->shape) {
    case EDGE:
        return truth_disc_share(fmin(1.0, fmax(-1.0, limit(-x))));
    case SLIT:
        return fmax(0.0, truth_disc_share(fmin(1.0, fmax(-1.0, limit(GAP - x)))) +
                             truth_disc_share(fmin(1.0, fmax(-1.0, limit(GAP + x)))) - 1.0);
    case CORNER:
        return beside_corner(x, z);
    default:
        return 1.0 - overlap(RADIUS / HEIGHT / WIDE, hypot(x, z) / HEIGHT / WIDE);
    }
}

/* Malley's: directions are even over the disc below them, and walls hide where they are nearer than the
 * distance. */
static inline double ao_truth(const stage *s, double x, double z) {
    switch (s->shape) {
    case EDGE:
        return truth_disc_share(fmin(1.0, -x / DISTANCE));
    case SLIT:
        return truth_disc_share(fmin(1.0, -x / DISTANCE)) +
               truth_disc_share(fmin(1.0, (1.5 + x) / DISTANCE)) - 1.0;
    case CORNER:
        return below_both(-x / DISTANCE, -z / DISTANCE);
    default: { /* a parallel disc: Hottel's configuration factor */
        const double h = HEIGHT / (4.0 * RADIUS), r = hypot(x, z) / (4.0 * RADIUS), sum = 1.0 + h * h + r * r;
        return 1.0 - 0.5 * (1.0 - (h * h + r * r - 1.0) / sqrt(sum * sum - 4.0 * r * r));
    }
    }
}

static inline double truth_at(const stage *s, double x, double z) {
    return s->ao ? ao_truth(s, x, z) : shadow_truth(s, x, z);
}

#endif
