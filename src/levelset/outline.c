/* An outline extruded: its distance in closed form from that to the outline. */
#include "outline/outline.h"
#include "base/elementary.h"
#include "base/floats.h"
#include "base/similarity.h"
#include "base/vec.h"

#include <vdbshade/grid.h>

#include <string.h>

typedef struct extrusion {
    const vsh_outline *outline;
    double inverse[12]; /* world to local */
    double scale;       /* local to world */
    double half;        /* of the thickness, local */
} extrusion;

static double distance(void *user, const double position[3]) {
    const extrusion *e = user;
    const vshi_vec p = vshi_transform_point(e->inverse, vshi_vec_of(position));
    const vshi_point flat = {p.x, p.y};
    const double above = fabs(p.z) - e->half;
    double beside = sqrt(vshi_outline_square(e->outline, flat, INFINITY));
    beside = vshi_outline_winding(e->outline, flat) != 0 ? -beside : beside;
    const double d = beside > 0.0 && above > 0.0 ? vshi_hypot(beside, above) : fmax(beside, above);
    return e->scale * d;
}

/* The inverse of a similarity: its transpose over the square of its scale. */
static void invert(const double m[12], double scale, double inverse[12]) {
    const double square = scale * scale;
    for (int row = 0; row < 3; ++row) {
        double *r = inverse + 4 * row;
        r[3] = 0.0;
        for (int column = 0; column < 3; ++column) {
            r[column] = m[4 * column + row] / square;
            r[3] -= r[column] * m[4 * column + 3];
        }
    }
}

vsh_result vsh_grid_from_outline(const vsh_outline *outline, double thickness, const double *transform,
                                 const vsh_grid_options *options, const vsh_run *run, vsh_grid **grid,
                                 vsh_error *error) {
    VSHI_FLOATS;
    static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    VSHI_NEEDS(grid);
    *grid = NULL;
    VSHI_NEEDS(outline);
    if (!(thickness > 0.0 && thickness <= VSHI_OUTLINE_LARGEST)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "outline: thickness %.9g: expected more than 0, at most %g", thickness,
                         VSHI_OUTLINE_LARGEST);
    }
    const double *m = transform != NULL ? transform : identity;
    extrusion e = {.outline = outline, .scale = vshi_similarity_scale(m), .half = 0.5 * thickness};
    if (!(e.scale > 0.0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "outline: its transform must neither shear nor scale unevenly");
    }
    invert(m, e.scale, e.inverse);
    vsh_distance field = {
        distance, &e, 1.0, 1, {INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    const vshi_outline_node *root = &outline->nodes[0];
    for (int corner = 0; corner < 8; ++corner) {
        const vshi_vec p = vshi_transform_point(m, (vshi_vec){corner & 1 ? root->high[0] : root->low[0],
                                                              corner & 2 ? root->high[1] : root->low[1],
                                                              corner & 4 ? e.half : -e.half});
        const double world[3] = {p.x, p.y, p.z};
        for (int axis = 0; axis < 3; ++axis) {
            field.bounds_min[axis] = fmin(field.bounds_min[axis], world[axis]);
            field.bounds_max[axis] = fmax(field.bounds_max[axis], world[axis]);
        }
    }
    return vsh_grid_from_distance(&field, options, run, grid, error);
}
