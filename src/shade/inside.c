/* Tells points in solids by rays. A point is inside if a ray first meets the inner side of a solid, so two
 * rays nearly always decide. If they disagree, more rays are followed all the way: a ray leaves one solid
 * more than it enters for each solid around its origin, also if solids overlap. Meshes have holes and flipped
 * faces, so a clear majority decides, and a point seen by many rays from outside is outside. */
#include "base/vec.h"
#include "shade/shade.h"
#include "trace/trace.h"

#include <math.h>
#include <string.h>

enum {
    AT_ONCE = 128,
    FIRST = 2,   /* rays of every point */
    SECOND = 6,  /* second rays, if the first ones meet solids that were closed over holes: all must agree */
    COUNTED = 3, /* rays followed all the way for all other points; if they disagree: */
    MORE = 14,
    TURNS = 4 /* if these leave doubt: as many times MORE, turned about the normal */
};

/* Share of rays that must say inside if rays disagree. A head's eye, seen through its hole by a third of the
 * rays, must be baked. */
static const double MAJORITY = 0.72;

/* If the share of rays that say inside is between these, more rays are cast. */
static const double UNCLEAR[2] = {0.5, 0.95};

/* Linked points have normals with at least this cosine. */
static const double ALIKE = 0.9;

/* MAJORITY of points where all COUNTED rays say inside, but a first ray does not. Under the mouth of a pipe
 * whose faces look inwards, three rays enter the pipe, and more than half escape. */
static const double AGREED = 2.0 / 3.0;

/* Rays begin a little off the surface, and so on the wrong side of triangles that are closer. Points that are
 * found inside and have such a triangle are tested again from this part of the distance, which is some
 * roundings of a float. */
static const double NEARER = 0.25;

/* Directions over a hemisphere around +z, a golden angle apart, from 18° to 75° off the normal. None lies
 * along an axis, as the edges of buildings do. The first two lean to opposite sides. */
static const double DIRECTIONS[FIRST + MORE][3] = {
    {+0.44378, +0.13502, 0.88590}, {-0.61737, -0.22410, 0.75408}, {+0.29617, -0.50253, 0.81225},
    {-0.10473, +0.65201, 0.75094}, {+0.73921, +0.24787, 0.62620}, {-0.66702, +0.53311, 0.52042},
    {+0.08537, -0.86170, 0.50019}, {+0.60118, -0.67004, 0.43552}, {-0.29341, -0.18922, 0.93706},
    {+0.17255, +0.37840, 0.90942}, {-0.48012, +0.28530, 0.82954}, {-0.30120, -0.60322, 0.73851},
    {+0.52033, +0.58190, 0.62495}, {-0.85210, -0.17390, 0.49367}, {-0.21844, +0.85512, 0.47014},
    {+0.88915, -0.22030, 0.40107},
};

/* Cosine and sine of the turns: 23° each, so that no direction repeats. */
static const double TURNED[TURNS][2] = {{1.0, 0.0},
                                        {0.92050485345244033, 0.39073112848927377},
                                        {0.69465837045899725, 0.71933980033865119},
                                        {0.35836794954530027, 0.93358042649720174}};

typedef struct solid_test {
    const vshi_triangles *triangles;
    const double *positions; /* [count][3] */
    const float *normals;
    double offset;
    bool holes;                  /* solids have holes: a ray that escapes proves nothing */
    const vshi_open_field *open; /* NULL: none */
} solid_test;

/* The origin of a point's rays. */
static vshi_vec origin_of(const solid_test *l, size_t point) {
    const vshi_vec normal = vshi_unit(vshi_vec_off(l->normals + 3 * point));
    return vshi_add(vshi_vec_of(l->positions + 3 * point), vshi_scale(normal, l->offset));
}

/* The origin of a point's rays, and axes for their directions. */
typedef struct frame {
    vshi_vec origin, u, v, normal;
} frame;

static frame frame_of(const solid_test *l, size_t point) {
    frame f = {.origin = origin_of(l, point), .normal = vshi_unit(vshi_vec_off(l->normals + 3 * point))};
    if (!(vshi_dot(f.normal, f.normal) > 0.5)) {
        f.normal = (vshi_vec){0.0, 0.0, 1.0};
    }
    vshi_frame(f.normal, &f.u, &f.v);
    return f;
}

static vshi_segment_ray aim_in(const frame *f, double x, double y, double z) {
    const vshi_vec d =
        vshi_unit(vshi_add(vshi_add(vshi_scale(f->u, x), vshi_scale(f->v, y)), vshi_scale(f->normal, z)));
    return (vshi_segment_ray){{f->origin.x, f->origin.y, f->origin.z}, {d.x, d.y, d.z}, INFINITY};
}

static void aim(const solid_test *l, size_t point, size_t direction, vshi_segment_ray *ray) {
    const size_t turn = direction < FIRST ? 0 : (direction - FIRST) / MORE;
    const double *by = DIRECTIONS[direction - turn * MORE], c = TURNED[turn][0], s = TURNED[turn][1];
    const frame f = frame_of(l, point);
    *ray = aim_in(&f, c * by[0] - s * by[1], s * by[0] + c * by[1], by[2]);
}

/* Whether a ray, followed all the way, begins in a solid. */
static bool begins_inside(const solid_test *l, size_t point, int direction) {
    vshi_segment_ray ray;
    aim(l, point, (size_t)direction, &ray);
    return vshi_triangles_depth(l->triangles, &ray) > 0;
}

/* Follows rays all the way, more if they disagree with each other or with the first. */
static uint8_t count_through(const solid_test *l, size_t point) {
    int inside = 0, all = MORE;
    double share = MAJORITY;
    for (int k = 0; k < COUNTED; ++k) {
        inside += begins_inside(l, point, FIRST + k);
    }
    if (inside == 0) {
        return VSHI_OUTSIDE;
    }
    if (inside == COUNTED) {
        for (int k = 0; k < FIRST; ++k) {
            inside += begins_inside(l, point, k);
        }
        if (inside == COUNTED + FIRST) {
            return VSHI_INSIDE;
        }
        all += FIRST;
        share = AGREED;
    }
    for (int k = COUNTED; k < MORE; ++k) {
        inside += begins_inside(l, point, FIRST + k);
    }
    if (inside > UNCLEAR[0] * all && inside < UNCLEAR[1] * all) {
        for (int k = MORE; k < TURNS * MORE; ++k) {
            inside += begins_inside(l, point, FIRST + k);
        }
        all += (TURNS - 1) * MORE;
    }
    if (inside < share * all) {
        return VSHI_OUTSIDE;
    }
    return VSHI_INSIDE;
}

/* For a point whose first rays all begin in solids with holes: whether the second rays do, too. */
static uint8_t confirm(const solid_test *l, size_t point) {
    vshi_segment_ray rays[SECOND];
    uint8_t meets[SECOND];
    for (size_t k = 0; k < SECOND; ++k) {
        aim(l, point, FIRST + k, &rays[k]);
    }
    vshi_triangles_meet(l->triangles, rays, SECOND, meets);
    for (size_t k = 0; k < SECOND; ++k) {
        if (meets[k] < VSHI_MEETS_SOLID) {
            return count_through(l, point);
        }
    }
    return VSHI_INSIDE;
}

/* Whether the field knows that a point is in the open. */
static bool is_open(const solid_test *l, size_t point) {
    const vshi_open_field *open = l->open;
    return open != NULL &&
           open->field->voxel_size * vshi_distance_at(open->field, open->at[point]) >= open->least;
}

/* Tests the listed points. */
static void test_points(const solid_test *l, const size_t *points, size_t count, uint8_t *where) {
    vshi_segment_ray rays[FIRST * AT_ONCE];
    uint8_t meets[FIRST * AT_ONCE];
    size_t asked = 0;
    for (size_t k = 0; k < FIRST; ++k) { /* rays of neighbours together: they are similar */
        for (size_t i = 0; i < count; ++i) {
            aim(l, points[i], k, &rays[asked++]);
        }
    }
    if (asked > 0) {
        vshi_triangles_meet(l->triangles, rays, asked, meets);
    }
    for (size_t i = 0; i < count; ++i) {
        int met[VSHI_MEETS_COUNT] = {0};
        for (size_t k = 0; k < FIRST; ++k) {
            ++met[meets[k * count + i]];
        }
        const size_t point = points[i];
        const bool escapes = met[VSHI_MEETS_NOTHING] > 0;
        const int inside = met[VSHI_MEETS_SOLID] + met[VSHI_MEETS_HOLED];
        if (inside == FIRST) {
            where[point] = met[VSHI_MEETS_HOLED] > 0 ? confirm(l, point) : VSHI_INSIDE;
        } else if (inside == 0 && ((escapes && !l->holes) || is_open(l, point))) {
            where[point] = VSHI_OUTSIDE;
        } else {
            where[point] = count_through(l, point);
        }
    }
}

/* Tests the points first … first + count - 1 again if they are inside and have a triangle closer than the
 * offset. */
static void retest_nearer(const solid_test *l, size_t first, size_t count, uint8_t *where) {
    solid_test nearer = *l;
    nearer.offset *= NEARER;
    vshi_segment_ray rays[AT_ONCE];
    size_t of[AT_ONCE], some = 0;
    bool blocked[AT_ONCE];
    for (size_t i = first; i < first + count; ++i) {
        if (where[i] != VSHI_OUTSIDE) {
            const vshi_vec normal = vshi_vec_off(l->normals + 3 * i);
            const vshi_vec p = vshi_add(vshi_vec_of(l->positions + 3 * i), vshi_scale(normal, nearer.offset));
            rays[some] = (vshi_segment_ray){{p.x, p.y, p.z}, {normal.x, normal.y, normal.z}, l->offset};
            of[some++] = i;
        }
    }
    if (some > 0) {
        vshi_triangles_blocked(l->triangles, rays, some, blocked);
    }
    for (size_t k = 0; k < some; ++k) {
        if (blocked[k]) {
            test_points(&nearer, &of[k], 1, where);
        }
    }
}

/* Finds which points first … first + count - 1 are linked to the one before: no triangle cuts a ray between
 * them, so they share a result. */
static void link_points(const solid_test *l, const bool *follows, size_t first, size_t count, bool *linked) {
    vshi_segment_ray rays[AT_ONCE];
    size_t of[AT_ONCE], some = 0;
    bool blocked[AT_ONCE];
    for (size_t k = 0; k < count; ++k) {
        const size_t i = first + k;
        linked[k] = false;
        if (follows == NULL || !follows[i] || l->holes) { /* rays disagree more and more near a hole */
            continue;
        }
        const vshi_vec from = origin_of(l, i - 1), way = vshi_sub(origin_of(l, i), from);
        const double length = vshi_length(way);
        const double alike =
            vshi_dot(vshi_vec_off(l->normals + 3 * i), vshi_vec_off(l->normals + 3 * (i - 1)));
        if (alike > ALIKE && length > 0.0 && isfinite(length)) {
            const vshi_vec d = vshi_scale(way, 1.0 / length);
            rays[some] = (vshi_segment_ray){{from.x, from.y, from.z}, {d.x, d.y, d.z}, length};
            of[some++] = k;
        }
    }
    if (some > 0) {
        vshi_triangles_blocked(l->triangles, rays, some, blocked);
    }
    for (size_t k = 0; k < some; ++k) {
        linked[of[k]] = !blocked[k];
    }
}

/* Tests the points first … first + count - 1. */
static void test_linked(const solid_test *l, const bool *follows, size_t first, size_t count,
                        uint8_t *where) {
    bool linked[AT_ONCE];
    size_t points[AT_ONCE], some = 0;
    link_points(l, follows, first, count, linked);
    for (size_t k = 0; k < count; ++k) {
        if (!linked[k]) {
            points[some++] = first + k;
        }
    }
    if (some > 0) {
        test_points(l, points, some, where);
    }
    for (size_t k = 0; k < count; ++k) {
        where[first + k] = where[first + k - (linked[k] ? 1 : 0)];
    }
}

/* Whether a point sees only inner sides of solids and vessels, as below a house without a floor. Flat rays
 * find the gap below a cloth on a table. */
static bool is_hidden(const solid_test *l, size_t point) {
    enum { ALL = FIRST + MORE };
    static const double FLAT = 0.06; /* tangent of their height above the surface */
    const frame f = frame_of(l, point);
    for (size_t k = 0; k < 2 * ALL; ++k) { /* one of the first rays mostly escapes */
        const double *by = DIRECTIONS[k % ALL];
        const double up = k < ALL ? FLAT * sqrt(by[0] * by[0] + by[1] * by[1]) : by[2];
        const vshi_segment_ray ray = aim_in(&f, by[0], by[1], up);
        if (!vshi_triangles_meet_inner(l->triangles, &ray)) {
            return false;
        }
    }
    return true;
}

/* Finds hidden points among first … first + count - 1 that are outside. They have a triangle above. */
static void find_hidden(const solid_test *l, size_t first, size_t count, uint8_t *where) {
    vshi_segment_ray rays[AT_ONCE];
    bool blocked[AT_ONCE];
    for (size_t k = 0; k < count; ++k) {
        const frame f = frame_of(l, first + k);
        rays[k] = aim_in(&f, 0.0, 0.0, 1.0);
    }
    vshi_triangles_blocked(l->triangles, rays, count, blocked);
    for (size_t k = 0; k < count; ++k) {
        if (blocked[k] && where[first + k] == VSHI_OUTSIDE && is_hidden(l, first + k)) {
            where[first + k] = VSHI_INSIDE;
        }
    }
}

void vshi_inside(const vshi_triangles *triangles, size_t count, const double *positions, const float *normals,
                 const bool *follows, const vshi_open_field *open, uint8_t *where) {
    memset(where, VSHI_OUTSIDE, count);
    if (!vshi_triangles_have_solids(triangles)) {
        return;
    }
    const solid_test l = {
        triangles, positions, normals, vshi_triangles_offset(triangles), vshi_triangles_have_holes(triangles),
        open};
    for (size_t first = 0; first < count; first += AT_ONCE) {
        const size_t some = count - first < AT_ONCE ? count - first : AT_ONCE;
        test_linked(&l, follows, first, some, where);
    }
    for (size_t first = 0; first < count; first += AT_ONCE) {
        const size_t some = count - first < AT_ONCE ? count - first : AT_ONCE;
        retest_nearer(&l, first, some, where);
        if (vshi_triangles_have_vessels(triangles)) {
            find_hidden(&l, first, some, where);
        }
    }
}
