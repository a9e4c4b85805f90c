/* Outlines extruded to solids: level sets against closed forms and against every segment. */
#include "grids.h"
#include "testing.h"

static vsh_outline *rectangle(double x, double y) {
    const double points[8] = {-x, -y, x, -y, x, y, -x, y};
    const size_t count = 4;
    vsh_outline *outline = NULL;
    assert_ok(vsh_outline_from_polygons(points, &count, 1, NULL, &outline, &failure));
    return outline;
}

/* A box of half size (1, 0.5, 0.3), in its own space. */
static double box_distance(const double p[3]) {
    const double q[3] = {fabs(p[0]) - 1.0, fabs(p[1]) - 0.5, fabs(p[2]) - 0.3};
    const double outside = hypot(hypot(fmax(q[0], 0.0), fmax(q[1], 0.0)), fmax(q[2], 0.0));
    return outside + fmin(0.0, fmax(q[0], fmax(q[1], q[2])));
}

TEST(a_box_is_a_box) {
    OWNED(vsh_outline) *outline = rectangle(1.0, 0.5);
    OWNED(vsh_grid) *grid = NULL;
    const vsh_grid_options options = with_voxel(0.02);
    assert_ok(vsh_grid_from_outline(outline, 0.6, NULL, &options, NULL, &grid, &failure));
    const double worst = worst_error(grid, box_distance, 2.9, 2.9);
    assert_true(worst < 1e-5);
}

/* Mirrored in x, scaled by 2, turned by 90° about x and moved. */
static const double placed[12] = {-2, 0, 0, 3, 0, 0, -2, -1, 0, 2, 0, 0.5};

static double placed_distance(const double p[3]) {
    const double local[3] = {-(p[0] - 3.0) / 2.0, (p[2] - 0.5) / 2.0, -(p[1] + 1.0) / 2.0};
    return 2.0 * box_distance(local);
}

TEST(a_transform_moves_the_solid) {
    OWNED(vsh_outline) *outline = rectangle(1.0, 0.5);
    OWNED(vsh_grid) *grid = NULL;
    const vsh_grid_options options = with_voxel(0.05);
    assert_ok(vsh_grid_from_outline(outline, 0.6, placed, &options, NULL, &grid, &failure));
    assert_true(worst_error(grid, placed_distance, 2.9, 2.9) < 1e-5);
}

static vsh_outline *letters;

/* By every segment in turn, and a count of crossings. */
static double letters_distance(const double p[3]) {
    double least = INFINITY;
    int winding = 0;
    size_t count;
    const double *q;
    for (size_t c = 0; (q = vsh_outline_contour(letters, c, &count)) != NULL; ++c) {
        for (size_t i = 0; i < count; ++i) {
            const double *a = q + 2 * i, *b = q + 2 * ((i + 1) % count);
            const double dx = b[0] - a[0], dy = b[1] - a[1];
            double t = ((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / (dx * dx + dy * dy);
            t = fmin(1.0, fmax(0.0, t));
            least = fmin(least, hypot(p[0] - a[0] - t * dx, p[1] - a[1] - t * dy));
            if ((a[1] <= p[1]) != (b[1] <= p[1]) && a[0] + (p[1] - a[1]) * dx / dy > p[0]) {
                winding += dy > 0.0 ? 1 : -1;
            }
        }
    }
    const double flat = winding != 0 ? -least : least, above = fabs(p[2]) - 0.1;
    return flat > 0.0 && above > 0.0 ? hypot(flat, above) : fmax(flat, above);
}

TEST(text_is_extruded_with_its_distance) {
    assert_ok(vsh_outline_from_text("d&", "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf", NULL, NULL,
                                    &letters, &failure));
    OWNED(vsh_grid) *grid = NULL, *again = NULL;
    vsh_run run = vsh_run_default();
    const vsh_grid_options options = with_voxel(0.03);
    assert_ok(vsh_grid_from_outline(letters, 0.2, NULL, &options, &run, &grid, &failure));
    const double worst = worst_error(grid, letters_distance, 2.9, 2.9);
    assert_true(worst < 1e-5);
    run.threads = 1;
    assert_ok(vsh_grid_from_outline(letters, 0.2, NULL, &options, &run, &again, &failure));
    assert_same_leaves(grid, again, 0.0f);
    vsh_outline_free(letters);
}

TEST(bad_solids_are_refused) {
    OWNED(vsh_outline) *outline = rectangle(1.0, 0.5);
    vsh_grid *grid = NULL;
    const vsh_grid_options options = with_voxel(0.02);
    const double thicknesses[] = {0.0, -1.0, NAN, INFINITY, 1e16};
    for (size_t i = 0; i < sizeof thicknesses / sizeof thicknesses[0]; ++i) {
        assert_fails(vsh_grid_from_outline(outline, thicknesses[i], NULL, &options, NULL, &grid, &failure),
                     VSH_ERROR_ARGUMENT, "thickness");
    }
    const double sheared[12] = {1, 1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    assert_fails(vsh_grid_from_outline(outline, 1.0, sheared, &options, NULL, &grid, &failure),
                 VSH_ERROR_ARGUMENT, "shear");
    vsh_run run = run_within(1 << 20);
    const vsh_grid_options fine = with_voxel(0.0005);
    assert_fails(vsh_grid_from_outline(outline, 1.0, NULL, &fine, &run, &grid, &failure), VSH_ERROR_LIMIT,
                 "");
    assert_null(grid);
}
