/* An extruded outline: its distance in closed form, from the distance to the outline. */
#include "shapes/outline.h"
#include "base/elementary.h"
#include "base/floats.h"
#include "base/vec.h"

#include <vdbshade/grid.h>

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
    VSHI_MAKES(grid);
    VSHI_NEEDS(outline);
    if (!(thickness > 0.0 && thickness <= VSHI_OUTLINE_LARGEST)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "outline: thickness %.9g: expected more than 0, at most %g", thickness,
                         VSHI_OUTLINE_LARGEST);
    }
    const double *m = transform != NULL ? transform : vshi_identity;
    extrusion e = {.outline = outline, .scale = vshi_similarity_scale(m), .half = 0.5 * thickness};
    if (!(e.scale > 0.0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "outline: its transform must neither shear nor scale unevenly");
    }
    invert(m, e.scale, e.inverse);
    vsh_distance field = {
        distance, &e, 1.0, 1, {INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    const vshi_outline_node *root = &outline->nodes[0];
    vshi_grow_box_by(field.bounds_min, field.bounds_max, m, (double[]){root->low[0], root->low[1], -e.half},
                     (double[]){root->high[0], root->high[1], e.half});
    return vsh_grid_from_distance(&field, options, run, grid, error);
}
