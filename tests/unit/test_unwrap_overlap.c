/* Charts that lie over themselves although no triangle flips. */
#include "shapes.h"

#include "unwrap/overlap.h"

enum { MOST = 64 };

/* A patch of its triangles and UVs alone, which is all that is looked at. */
static int overlaps(double (*uv)[2], uint32_t vertices, uint32_t (*corner)[3], uint32_t count) {
    uint32_t beyond[3 * MOST];
    for (uint32_t i = 0; i < 3 * count; ++i) {
        beyond[i] = VSHI_NONE;
        for (uint32_t k = 0; k < 3 * count; ++k) {
            if (corner[i / 3][i % 3] == corner[k / 3][(k + 1) % 3] &&
                corner[i / 3][(i + 1) % 3] == corner[k / 3][k % 3]) {
                beyond[i] = k;
            }
        }
    }
    const vshi_patch patch = {
        .count = count, .vertex_count = vertices, .corner = corner, .beyond = beyond, .uv = uv};
    for (uint32_t i = 0; i < count; ++i) {
        assert_true(vshi_patch_doubled_area(&patch, i) > 0.0);
    }
    bool found = false;
    assert_int_equal(vshi_patch_overlaps(&patch, &found, NULL), VSH_OK);
    return found;
}

/* A slit from A to C, whose two sides have a vertex each in the middle: apart by `gap`, or over each other.
 */
static int slit_overlaps(double gap) {
    enum { A, C, WEST, EAST, SOUTH, NORTH, ON_LEFT, ON_RIGHT };
    double uv[8][2] = {{0, -1}, {0, 1}, {-2, 0}, {2, 0}, {0, -3}, {0, 3}, {-gap, 0}, {gap, 0}};
    uint32_t corner[8][3] = {{WEST, A, ON_LEFT}, {WEST, ON_LEFT, C}, {EAST, C, ON_RIGHT}, {EAST, ON_RIGHT, A},
                             {WEST, SOUTH, A},   {SOUTH, EAST, A},   {WEST, C, NORTH},    {EAST, NORTH, C}};
    return overlaps(uv, 8, corner, 8);
}

static void a_hole_turned_inside_out_is_overlap_however_small(void **state) {
    (void)state;
    assert_false(slit_overlaps(0.5));
    assert_false(slit_overlaps(0.001));
    assert_false(slit_overlaps(0.0)); /* its sides touch */
    assert_true(slit_overlaps(-0.001));
    assert_true(slit_overlaps(-0.5));
}

/* A strip of quads around a turn and some, whose ends lie over each other unless the second is moved out. */
static int spiral_overlaps(double turns, double out) {
    enum { STEPS = 24 };
    double uv[2 * STEPS + 2][2];
    uint32_t corner[2 * STEPS][3];
    for (uint32_t i = 0; i <= STEPS; ++i) {
        const double angle = 6.283185307179586 * turns * i / STEPS, r = 1 + out * i / STEPS;
        for (uint32_t k = 0; k < 2; ++k) {
            uv[2 * i + k][0] = (r + 0.2 * k) * cos(angle);
            uv[2 * i + k][1] = (r + 0.2 * k) * sin(angle);
        }
    }
    for (uint32_t i = 0; i < STEPS; ++i) {
        const uint32_t v = 2 * i;
        memcpy(corner[2 * i], (uint32_t[3]){v, v + 1, v + 3}, sizeof corner[0]);
        memcpy(corner[2 * i + 1], (uint32_t[3]){v, v + 3, v + 2}, sizeof corner[0]);
    }
    return overlaps(uv, 2 * STEPS + 2, corner, 2 * STEPS);
}

static void ends_that_lie_over_each_other_are_overlap(void **state) {
    (void)state;
    assert_false(spiral_overlaps(0.9, 0.0));
    assert_false(spiral_overlaps(1.2, 0.4));
    assert_true(spiral_overlaps(1.2, 0.05));    /* borders cross */
    assert_true(spiral_overlaps(1.0005, 0.05)); /* by less than the raster sees */
    assert_true(spiral_overlaps(1.25, 0.0)); /* they lie along each other, and cross nowhere but at corners */
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_hole_turned_inside_out_is_overlap_however_small),
        cmocka_unit_test(ends_that_lie_over_each_other_are_overlap),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
