/* Polygons cut into triangles: their area is that of the polygon, and none is flipped. */
#include "io/model/faces.h"
#include "testing.h"

enum { MOST = 4096 };

typedef struct shape {
    float at[MOST][3];
    uint32_t corner[MOST];
    size_t count;
} shape;

static uint64_t seed;

static double random_unit(void) {
    seed = seed * 6364136223846793005U + 1442695040888963407U;
    return (double)(seed >> 11) / 9007199254740992.0;
}

/* Twice the signed area in x and y; products of floats are exact in double. */
static double doubled_area(const shape *s, const uint32_t *corner, size_t count) {
    double area = 0.0;
    for (size_t i = 0; i < count; ++i) {
        const float *p = s->at[corner[i]], *q = s->at[corner[i + 1 < count ? i + 1 : 0]];
        area += (double)p[0] * (double)q[1] - (double)p[1] * (double)q[0];
    }
    return area;
}

static uint32_t triangles[3 * MOST];

typedef struct cutting {
    size_t made; /* triangles */
    bool simple;
    double least; /* area of one, times two; negative if it is turned over */
} cutting;

/* Cuts a polygon in x and y. The triangles add up to it. */
static cutting cut(const shape *s) {
    vshi_job *job = vshi_job_begin(NULL, "load", 1);
    vshi_face_cutter cutter = {.positions = s->at[0], .job = job};
    cutting c = {.least = INFINITY};
    assert_ok(vshi_face_cut(&cutter, s->corner, s->count, triangles, &c.made, &failure));
    c.simple = cutter.crossing == 0;
    vshi_face_cutter_end(&cutter, NULL, "", "");
    vshi_job_end(job);
    assert_true(c.made <= s->count - 2);
    const double whole = doubled_area(s, s->corner, s->count);
    double sum = 0.0;
    for (size_t i = 0; i < c.made; ++i) {
        const double area = doubled_area(s, triangles + 3 * i, 3);
        c.least = fmin(c.least, whole < 0.0 ? -area : area);
        sum += area;
    }
    assert_that(fabs(sum - whole) <= 1e-9 * fabs(whole), "%zu corners: triangles of %.12g, polygon of %.12g",
                s->count, sum, whole);
    return c;
}

/* Returns the number of triangles. */
static size_t cut_simple(const shape *s) {
    const cutting c = cut(s);
    assert_that(c.simple && c.least > 0.0, "%zu corners: %s, least area %g", s->count,
                c.simple ? "simple" : "crossing", c.least);
    return c.made;
}

static void set(shape *s, const float (*at)[2], size_t count) {
    s->count = count;
    for (size_t i = 0; i < count; ++i) {
        s->at[i][0] = at[i][0];
        s->at[i][1] = at[i][1];
        s->at[i][2] = 0.0F;
        s->corner[i] = (uint32_t)i;
    }
}

static bool crosses(const shape *s, size_t i, size_t k) {
    const float *a = s->at[i], *b = s->at[(i + 1) % s->count], *c = s->at[k], *d = s->at[(k + 1) % s->count];
#define SIDE(p, q, r)                                                                                        \
    (((double)(q)[0] - (double)(p)[0]) * ((double)(r)[1] - (double)(p)[1]) -                                 \
     ((double)(q)[1] - (double)(p)[1]) * ((double)(r)[0] - (double)(p)[0]))
    return SIDE(a, b, c) * SIDE(a, b, d) < 0.0 && SIDE(c, d, a) * SIDE(c, d, b) < 0.0;
#undef SIDE
}

/* Random points whose crossing edges are swapped until none cross (2-opt): as twisted as polygons get. On a
 * grid of small integers many corners lie on lines. */
static bool make_twisted(shape *s, size_t count, int grid) {
    float at[64][2];
    for (size_t i = 0; i < count; ++i) {
        for (int k = 0; k < 2; ++k) {
            at[i][k] = (float)(grid > 0 ? floor(random_unit() * grid) : random_unit());
        }
        for (size_t j = 0; j < i; ++j) {
            if (at[i][0] == at[j][0] && at[i][1] == at[j][1]) {
                return false;
            }
        }
    }
    set(s, (const float(*)[2])at, count);
    for (int round = 0; round < 400; ++round) {
        bool any = false;
        for (size_t i = 0; i + 2 < count; ++i) {
            for (size_t k = i + 2; k < count - (i == 0); ++k) {
                if (!crosses(s, i, k)) {
                    continue;
                }
                any = true;
                for (size_t low = i + 1, high = k; low < high; ++low, --high) {
                    float swapped[3];
                    memcpy(swapped, s->at[low], sizeof swapped);
                    memcpy(s->at[low], s->at[high], sizeof swapped);
                    memcpy(s->at[high], swapped, sizeof swapped);
                }
            }
        }
        if (!any) {
            return doubled_area(s, s->corner, count) != 0.0;
        }
    }
    return false;
}

TEST(every_simple_polygon_is_covered_and_no_triangle_is_flipped) {
    static shape s;
    seed = 7;
    size_t made = 0;
    for (int i = 0; i < 6000; ++i) {
        const size_t count = 4 + (size_t)(random_unit() * 28);
        if (make_twisted(&s, count, 0)) {
            assert_int_equal(cut_simple(&s), count - 2);
            ++made;
        }
    }
    assert_true(made > 5000);
}

/* Combs, spirals and stars, of many corners, in both directions of turning. */
TEST(long_and_narrow_polygons_are_covered) {
    static shape s;
    static float at[MOST][2];
    size_t n = 0;
    for (int tooth = 0; tooth < 500; ++tooth) {
        at[n][0] = (float)tooth, at[n++][1] = 0.0F;
        at[n][0] = (float)tooth + 0.25F, at[n++][1] = 100.0F;
        at[n][0] = (float)tooth + 0.5F, at[n++][1] = 0.0F;
    }
    at[n][0] = 500.0F, at[n++][1] = -1.0F;
    at[n][0] = -1.0F, at[n++][1] = -1.0F;
    set(&s, (const float(*)[2])at, n);
    cut_simple(&s);
    n = 0;
    for (int i = 100; i < 1000; ++i, ++n) { /* out, and back in at a little less */
        at[n][0] = (float)(i * cos(0.05 * i)), at[n][1] = (float)(i * sin(0.05 * i));
    }
    for (int i = 999; i > 100; --i, ++n) {
        at[n][0] = (float)((i - 20.0) * cos(0.05 * i)), at[n][1] = (float)((i - 20.0) * sin(0.05 * i));
    }
    set(&s, (const float(*)[2])at, n);
    for (size_t i = 0; i < n; ++i) {
        s.corner[i] = (uint32_t)(n - 1 - i);
    }
    cut_simple(&s);
    seed = 3;
    for (size_t i = 0; i < 2000; ++i) {
        const double r = 1.0 + 30.0 * random_unit(), angle = 6.283185307179586 * (double)i / 2000.0;
        at[i][0] = (float)(r * cos(angle)), at[i][1] = (float)(r * sin(angle));
    }
    set(&s, (const float(*)[2])at, 2000);
    cut_simple(&s);
}

/* From whichever corner each begins. */
TEST(known_polygons_are_cut_into_the_expected_number_of_triangles) {
    enum { NONE = -1 };
    static const struct {
        const char *name;
        float at[32];
        size_t count;
        int made; /* NONE: it crosses itself */
        double doubled_area;
    } cases[] = {
        {"an L", {0, 0, 2, 0, 2, 1, 1, 1, 1, 2, 0, 2}, 6, 4, 6.0},
        /* holes joined to the outline by an edge there and back */
        {"a hole", {0, 0, 4, 0, 4, 4, 0, 4, 0, 0, 1, 1, 1, 3, 3, 3, 3, 1, 1, 1}, 10, 8, 24.0},
        {"two holes",
         {0, 0, 8, 0, 8, 4, 0, 4, 0, 0, 1, 1, 1, 3, 3, 3, 3, 1, 5, 1, 5, 3, 7, 3, 7, 1, 5, 1, 3, 1, 1, 1},
         16,
         14,
         48.0},
        /* points within an edge stay corners of triangles: else the neighbours' edges would be open */
        {"an edge of five points", {4, 0, 0, 4, 0, 0, 1, 0, 2, 0, 3, 0}, 6, 4, 16.0},
        {"a triangle of four", {0, 0, 2, 0, 0, 2, 0, 1}, 4, 2, 4.0},
        {"a square of eight", {0, 0, 1, 0, 2, 0, 2, 1, 2, 2, 1, 2, 0, 2, 0, 1}, 8, 6, 8.0},
        {"a tie", {0, 0, 2, 2, 2, 0, 0, 1}, 4, NONE, 2.0},
        {"an even tie", {0, 0, 2, 2, 2, 0, 0, 2}, 4, NONE, 0.0},
        {"a star", {0, 10, 6, -8, -9, 3, 9, 3, -6, -8}, 5, NONE, 0.0},
    };
    static shape s;
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        const size_t count = cases[i].count;
        for (size_t first = 0; first < count; ++first) {
            float at[16][2];
            for (size_t k = 0; k < count; ++k) {
                memcpy(at[k], cases[i].at + 2 * ((first + k) % count), sizeof at[k]);
            }
            set(&s, (const float(*)[2])at, count);
            if (cases[i].made == NONE) {
                assert_false(cut(&s).simple);
            } else {
                assert_int_equal(cut_simple(&s), cases[i].made);
                assert_true(doubled_area(&s, s.corner, count) == cases[i].doubled_area);
            }
        }
    }
    static const float line[5][2] = {{0, 0}, {1, 1}, {2, 2}, {3, 3}, {1, 1}};
    set(&s, line, 5); /* no area, which is no crossing */
    assert_true(cut(&s).simple);
}

/* The fans that they have always been: bakes keep their bits. */
TEST(convex_polygons_are_fans_from_the_last_corner_and_quads_from_the_first) {
    static const float corners[6][2] = {{2, 0}, {1, 2}, {-1, 2}, {-2, 0}, {-1, -2}, {1, -2}};
    static const uint32_t fan[12] = {5, 0, 1, 2, 5, 1, 5, 2, 3, 3, 4, 5}, quad[6] = {0, 1, 2, 0, 2, 3};
    static shape s;
    set(&s, corners, 6);
    cut_simple(&s);
    assert_memory_equal(triangles, fan, sizeof fan);
    set(&s, corners, 4);
    cut_simple(&s);
    assert_memory_equal(triangles, quad, sizeof quad);
}

/* On integers, many corners lie on edges of others, which is more than simple polygons may do: whatever is
 * said of them, the triangles add up. */
TEST(polygons_that_touch_themselves_do_no_harm) {
    static shape s;
    seed = 11;
    size_t all = 0, crossing = 0;
    for (int i = 0; i < 3000; ++i) {
        if (make_twisted(&s, 4 + (size_t)(random_unit() * 20), 9)) {
            crossing += !cut(&s).simple;
            ++all;
        }
    }
    assert_true(all > 1000 && crossing < all / 5);
}
