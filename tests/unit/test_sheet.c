/* Sheets of triangles that cut beams: what is said to be cut lets no ray through, and what can be seen to be
 * cut is said to be. */
#include "shading.h"
#include "testing.h"

#include "mesh/sheet.h"

enum { EDGE = 25, CELLS = EDGE - 1 };

/* Numbers of [0, 1) that are the same everywhere. */
static double next_number(uint64_t *state) {
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) * 0x1p-53;
}

static double spread(uint64_t *state, double size) {
    return size * (2.0 * next_number(state) - 1.0);
}

static void join(vshi_sheet *sheet) {
    assert_ok(vshi_sheet_join(sheet, &failure));
}

/* A bumpy sheet of x, y in [-6, 6] around z = 5, without the cells that `missing` (a share) takes. */
static vshi_sheet bumpy(double height, double missing, uint64_t seed) {
    vshi_sheet sheet;
    assert_ok(vshi_sheet_allocate(&sheet, EDGE * EDGE, 2 * CELLS * CELLS, &failure));
    for (int i = 0; i < EDGE * EDGE; ++i) {
        float *p = sheet.vertices + 3 * i;
        p[0] = (float)(i % EDGE) * 0.5f - 6.0f;
        p[1] = (float)(i / EDGE) * 0.5f - 6.0f;
        p[2] = (float)(5.0 + spread(&seed, height));
    }
    size_t count = 0;
    for (uint32_t y = 0; y < CELLS; ++y) {
        for (uint32_t x = 0; x < CELLS; ++x) {
            const uint32_t a = y * EDGE + x, cell[6] = {a, a + 1, a + EDGE, a + 1, a + EDGE + 1, a + EDGE};
            if (next_number(&seed) >= missing) {
                memcpy(sheet.corners + 3 * count, cell, sizeof cell);
                count += 2;
            }
        }
    }
    sheet.triangle_count = count;
    join(&sheet);
    return sheet;
}

/* Where a ray meets a triangle: a distance, or a negative number (Möller and Trumbore, "Fast, minimum storage
 * ray-triangle intersection", 1997). */
static double meet(const vshi_sheet *sheet, size_t triangle, vshi_vec origin, vshi_vec direction) {
    vshi_vec p[3];
    for (int k = 0; k < 3; ++k) {
        p[k] = vshi_vec_off(sheet->vertices + 3 * (size_t)sheet->corners[3 * triangle + (size_t)k]);
    }
    const vshi_vec a = vshi_sub(p[1], p[0]), b = vshi_sub(p[2], p[0]), h = vshi_cross(direction, b);
    const double determinant = vshi_dot(a, h);
    if (determinant == 0.0) {
        return -1.0;
    }
    const vshi_vec s = vshi_sub(origin, p[0]), q = vshi_cross(s, a);
    const double u = vshi_dot(s, h) / determinant, v = vshi_dot(direction, q) / determinant;
    return u >= 0.0 && v >= 0.0 && u + v <= 1.0 ? vshi_dot(b, q) / determinant : -1.0;
}

static double first_hit(const vshi_sheet *sheet, vshi_vec origin, vshi_vec direction, uint32_t *triangle) {
    double nearest = INFINITY;
    for (size_t i = 0; i < sheet->triangle_count; ++i) {
        const double t = meet(sheet, i, origin, direction);
        if (t > 0.0 && t < nearest) {
            nearest = t;
            *triangle = (uint32_t)i;
        }
    }
    return nearest;
}

/* A ray of the beam. */
static void choose_ray(const vshi_sheet_beam *beam, uint64_t *state, vshi_vec *origin, vshi_vec *direction) {
    vshi_vec u, v, off;
    vshi_frame(beam->axis, &u, &v);
    do {
        off = (vshi_vec){spread(state, 1.0), spread(state, 1.0), spread(state, 1.0)};
    } while (vshi_dot(off, off) > 1.0);
    /* half of them from the rim, where a sheet that is too small would let them by */
    if (next_number(state) < 0.5) {
        off = vshi_unit(off);
    }
    const double angle = 2.0 * PI * next_number(state), out = beam->tangent * sqrt(next_number(state));
    *origin = vshi_add(beam->origin, vshi_scale(off, beam->wide));
    *direction = vshi_unit(
        vshi_add(beam->axis, vshi_add(vshi_scale(u, out * cos(angle)), vshi_scale(v, out * sin(angle)))));
}

TEST(what_is_cut_lets_no_ray_through) {
    uint64_t numbers = 5;
    size_t cut = 0, open = 0;
    for (int s = 0; s < 12; ++s) {
        FREED_BY(vshi_sheet_free)
        vshi_sheet sheet = bumpy(s % 3 == 0 ? 0.0 : 0.8, s % 4 == 0 ? 0.0 : 0.04, (uint64_t)s);
        for (int b = 0; b < 200; ++b) {
            vshi_sheet_beam beam = {
                .origin = {spread(&numbers, 5.0), spread(&numbers, 5.0), spread(&numbers, 1.0)},
                .axis = vshi_unit((vshi_vec){spread(&numbers, 0.7), spread(&numbers, 0.7), 1.0}),
                .wide = 1.5 * next_number(&numbers),
                .tangent = next_number(&numbers) < 0.2 ? 0.0 : 0.2 * next_number(&numbers),
                .end = INFINITY};
            uint32_t triangle = 0;
            const double distance = first_hit(&sheet, beam.origin, beam.axis, &triangle);
            if (!isfinite(distance) || !vshi_sheet_cuts(&sheet, &beam, triangle, distance, VSHI_SHEET_MOST)) {
                ++open;
                continue;
            }
            ++cut;
            for (int r = 0; r < 100; ++r) {
                vshi_vec origin, direction;
                choose_ray(&beam, &numbers, &origin, &direction);
                assert_true(isfinite(first_hit(&sheet, origin, direction, &triangle)));
            }
        }
    }
    assert_true(cut > 500 && open > 500);
}

TEST(whole_sheets_cut_what_is_within_their_borders) {
    FREED_BY(vshi_sheet_free) vshi_sheet sheet = bumpy(0.3, 0.0, 3);
    uint64_t numbers = 8;
    for (int b = 0; b < 200; ++b) {
        const vshi_sheet_beam beam = {.origin = {spread(&numbers, 3.0), spread(&numbers, 3.0), 0.0},
                                      .axis = {0.0, 0.0, 1.0},
                                      .wide = 0.5,
                                      .tangent = 0.05,
                                      .end = INFINITY};
        uint32_t triangle = 0;
        const double distance = first_hit(&sheet, beam.origin, beam.axis, &triangle);
        assert_true(vshi_sheet_cuts(&sheet, &beam, triangle, distance, VSHI_SHEET_MOST));
        /* nor where that would take more triangles, or the sheet is at the points or past the light */
        assert_false(vshi_sheet_cuts(&sheet, &beam, triangle, distance, 2));
        vshi_sheet_beam other = beam;
        other.end = 4.0;
        assert_false(vshi_sheet_cuts(&sheet, &other, triangle, distance, VSHI_SHEET_MOST));
        other = beam;
        other.origin.z = 4.5;
        assert_false(vshi_sheet_cuts(&sheet, &other, triangle, distance - 4.5, VSHI_SHEET_MOST));
    }
}

/* A box from z = 5 to 6, of x and y within 1. */
static vshi_sheet slab(void) {
    static const uint32_t FACES[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                       2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    vshi_sheet sheet;
    assert_ok(vshi_sheet_allocate(&sheet, 8, 12, &failure));
    for (int i = 0; i < 8; ++i) {
        sheet.vertices[3 * i] = i & 1 ? 1.0f : -1.0f;
        sheet.vertices[3 * i + 1] = i & 2 ? 1.0f : -1.0f;
        sheet.vertices[3 * i + 2] = i & 4 ? 6.0f : 5.0f;
    }
    memcpy(sheet.corners, FACES, sizeof FACES);
    join(&sheet);
    return sheet;
}

TEST(solids_cut_beams_that_they_are_wider_than) {
    FREED_BY(vshi_sheet_free) vshi_sheet sheet = slab();
    for (size_t i = 0; i < 36; ++i) {
        assert_true(sheet.neighbours[i] < 12);
    }
    for (int i = 0; i < 40; ++i) {
        const vshi_sheet_beam beam = {
            .origin = {0.1, 0.05, 0.0}, .axis = {0.0, 0.0, 1.0}, .wide = 0.05 * i + 0.01, .end = INFINITY};
        uint32_t triangle = 0;
        const double distance = first_hit(&sheet, beam.origin, beam.axis, &triangle);
        const bool within = beam.wide < 0.9;
        assert_true(fabs(beam.wide - 0.9) < 1e-3 ||
                    vshi_sheet_cuts(&sheet, &beam, triangle, distance, VSHI_SHEET_MOST) == within);
    }
}

/* What lies beyond an edge, by looking at all of them. */
static uint32_t beyond(const vshi_sheet *sheet, size_t edge) {
    const uint32_t *own = sheet->corners + edge / 3 * 3;
    const uint32_t a = own[edge % 3], b = own[(edge + 1) % 3];
    uint32_t found = VSHI_SHEET_BORDER;
    size_t count = 0;
    for (size_t other = 0; other < 3 * sheet->triangle_count; ++other) {
        const uint32_t *corner = sheet->corners + other / 3 * 3;
        const uint32_t c = corner[other % 3], d = corner[(other + 1) % 3];
        if (other != edge && ((a == c && b == d) || (a == d && b == c))) {
            found = (uint32_t)(other / 3);
            ++count;
        }
    }
    return count == 1 && a != b ? found : VSHI_SHEET_BORDER;
}

TEST(neighbours_are_those_of_exactly_two_triangles) {
    enum { TRIANGLES = 60 };
    uint64_t seed = 9;
    size_t joined = 0;
    /* from triangles that share most edges with many, folded and flat ones, too, to such that hardly meet */
    for (uint32_t vertices = 4; vertices < 200; vertices += vertices / 4) {
        FREED_BY(vshi_sheet_free) vshi_sheet sheet;
        assert_ok(vshi_sheet_allocate(&sheet, vertices, TRIANGLES, &failure));
        for (size_t i = 0; i < 3 * TRIANGLES; ++i) {
            sheet.corners[i] = (uint32_t)(next_number(&seed) * vertices);
        }
        join(&sheet);
        for (size_t edge = 0; edge < 3 * TRIANGLES; ++edge) {
            assert_int_equal(sheet.neighbours[edge], beyond(&sheet, edge));
            joined += sheet.neighbours[edge] != VSHI_SHEET_BORDER;
        }
    }
    assert_true(joined > 100);
}

int main(void) {
    return run_all_tests(NULL, NULL);
}
