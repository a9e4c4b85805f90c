#define _GNU_SOURCE /* qsort_r */
#include "io/model/faces.h"

#include "base/memory.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Triangulation by ears (Meisters, "Polygons have ears", 1975), with exact orientations. Coordinates are
 * floats, so products of two are exact in double. Expansions give the sign of their sum (Shewchuk, "Adaptive
 * precision floating-point arithmetic and fast robust geometric predicates", 1997).
 *
 * Projects the polygon along the axis nearest to its normal (Newell's). That keeps its coordinates; a
 * rotation into its plane would round them. Searches ears in the order of Assimp 5.2, so that convex polygons
 * become the same fans as before. Cuts an ear if no other corner lies in it or on its border. Accepts corners
 * on the border, and corners without an angle, only if there is no better ear. For speed, corners that can
 * lie in an ear are sorted along the polygon's longer side. */

typedef struct vshi_polygon_corner {
    float x, y; /* in the plane of projection */
    uint32_t next, previous;
    bool gone;
} corner;

/* --- exact orientation */

/* Adds b to an expansion of n components, which do not overlap, smallest first. It then has n + 1. */
static void grow_expansion(double *e, int n, double b) {
    double q = b;
    for (int i = 0; i < n; ++i) {
        const double sum = q + e[i];
        const double virtual_b = sum - q;
        e[i] = (q - (sum - virtual_b)) + (e[i] - virtual_b);
        q = sum;
    }
    e[n] = q;
}

/* > 0: a, b, c turn to the left; 0: they lie on a line. Exact. */
static double orient(const corner *a, const corner *b, const corner *c) {
    const double ax = (double)a->x, ay = (double)a->y, bx = (double)b->x, by = (double)b->y;
    const double cx = (double)c->x, cy = (double)c->y;
    const double left = (ax - cx) * (by - cy), right = (ay - cy) * (bx - cx);
    const double rough = left - right;
    /* Each difference has a relative error of 2^-53, like the products and their difference. */
    static const double margin = 8.0 / 9007199254740992.0;
    if (fabs(rough) > margin * (fabs(left) + fabs(right))) {
        return rough;
    }
    double e[6];
    const double terms[6] = {ax * by, -ay * bx, bx * cy, -by * cx, cx * ay, -cy * ax};
    for (int i = 0; i < 6; ++i) {
        grow_expansion(e, i, terms[i]);
    }
    int last = 5;
    while (last > 0 && e[last] == 0.0) {
        --last;
    }
    return e[last];
}

static bool same_place(const corner *a, const corner *b) {
    return a->x == b->x && a->y == b->y;
}

/* --- the polygon */

typedef struct cut {
    corner *c;
    uint32_t *reflex;
    size_t count, reflex_count;
    size_t left;  /* corners not yet cut */
    bool along_y; /* reflex corners are sorted by y, else by x */
    vshi_job *job;
    size_t tried; /* ears */
    const uint32_t *vertices;
    uint32_t *triangles; /* three numbers of corners each */
    size_t made;
    bool simple;
} cut;

/* Newell's normal (Sutherland, Sproull, Schumacker 1974), about the first corner. */
static void newell(const float *positions, const uint32_t *vertices, size_t count, double normal[3]) {
    const float *origin = positions + 3 * (size_t)vertices[0];
    normal[0] = normal[1] = normal[2] = 0.0;
    for (size_t i = 0; i < count; ++i) {
        const float *p = positions + 3 * (size_t)vertices[i];
        const float *q = positions + 3 * (size_t)vertices[i + 1 < count ? i + 1 : 0];
        for (int k = 0; k < 3; ++k) {
            const int u = (k + 1) % 3, v = (k + 2) % 3;
            const double pu = (double)p[u] - (double)origin[u], pv = (double)p[v] - (double)origin[v];
            const double qu = (double)q[u] - (double)origin[u], qv = (double)q[v] - (double)origin[v];
            normal[k] += pu * qv - pv * qu;
        }
    }
}

/* Projects the corners so that the polygon turns left. Returns false if it has no area. */
static bool project(cut *p, const float *positions) {
    double normal[3];
    newell(positions, p->vertices, p->count, normal);
    int axis = fabs(normal[1]) > fabs(normal[0]) ? 1 : 0;
    axis = fabs(normal[2]) > fabs(normal[axis]) ? 2 : axis;
    if (!(fabs(normal[axis]) > 0.0)) {
        return false;
    }
    const int u = (axis + (normal[axis] > 0.0 ? 1 : 2)) % 3, v = (axis + (normal[axis] > 0.0 ? 2 : 1)) % 3;
    float low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (size_t i = 0; i < p->count; ++i) {
        const float *at = positions + 3 * (size_t)p->vertices[i];
        p->c[i] = (corner){.x = at[u],
                           .y = at[v],
                           .next = (uint32_t)(i + 1 < p->count ? i + 1 : 0),
                           .previous = (uint32_t)(i > 0 ? i - 1 : p->count - 1)};
        low[0] = fminf(low[0], at[u]);
        low[1] = fminf(low[1], at[v]);
        high[0] = fmaxf(high[0], at[u]);
        high[1] = fmaxf(high[1], at[v]);
    }
    p->along_y = high[1] - low[1] > high[0] - low[0];
    return true;
}

static float key_of(const cut *p, uint32_t i) {
    return p->along_y ? p->c[i].y : p->c[i].x;
}

static int compare_keys(const void *a, const void *b, void *user) {
    const float one = key_of(user, *(const uint32_t *)a), other = key_of(user, *(const uint32_t *)b);
    return one < other ? -1 : one > other;
}

/* Finds corners that are not convex. If any corner lies in an ear, one of them does. Cutting adds none. */
static void find_reflex(cut *p) {
    p->reflex_count = 0;
    for (uint32_t i = 0; i < p->count; ++i) {
        if (!(orient(&p->c[p->c[i].previous], &p->c[i], &p->c[p->c[i].next]) > 0.0)) {
            p->reflex[p->reflex_count++] = i;
        }
    }
    qsort_r(p->reflex, p->reflex_count, sizeof *p->reflex, compare_keys, p);
}

/* Demands on an ear, strictest first. */
enum { CLEAN, FOLDING, TOUCHED, FLAT, ANY_CONVEX, ANY, DEMANDS };

/* Whether a corner lies in the triangle, or (closed) on its border, but not at its corners. */
static bool is_occupied(const cut *p, const corner *a, const corner *b, const corner *c, bool closed) {
    const float least = p->along_y ? fminf(a->y, fminf(b->y, c->y)) : fminf(a->x, fminf(b->x, c->x));
    const float most = p->along_y ? fmaxf(a->y, fmaxf(b->y, c->y)) : fmaxf(a->x, fmaxf(b->x, c->x));
    size_t low = 0, high = p->reflex_count;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (key_of(p, p->reflex[middle]) < least) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    for (size_t i = low; i < p->reflex_count && key_of(p, p->reflex[i]) <= most; ++i) {
        const corner *q = &p->c[p->reflex[i]];
        if (q->gone || same_place(q, a) || same_place(q, b) || same_place(q, c)) {
            continue;
        }
        const double ab = orient(a, b, q), bc = orient(b, c, q), ca = orient(c, a, q);
        if (closed ? ab >= 0.0 && bc >= 0.0 && ca >= 0.0 : ab > 0.0 && bc > 0.0 && ca > 0.0) {
            return true;
        }
    }
    return false;
}

/* Whether the border turns back on itself at b. */
static bool folds(const corner *a, const corner *b, const corner *c) {
    if (orient(a, b, c) != 0.0) {
        return false;
    }
    const double ux = (double)a->x - (double)b->x, uy = (double)a->y - (double)b->y;
    const double vx = (double)c->x - (double)b->x, vy = (double)c->y - (double)b->y;
    return ux * vx + uy * vy >= 0.0;
}

static bool is_ear(cut *p, uint32_t ear, int demand) {
    const corner *b = &p->c[ear], *a = &p->c[b->previous], *c = &p->c[b->next];
    const double turn = orient(a, b, c);
    ++p->tried;
    if (demand == ANY) {
        return true;
    }
    if (demand == FLAT) {
        return turn == 0.0;
    }
    if (!(turn > 0.0)) {
        return false;
    }
    if (demand == CLEAN && p->left > 3 && (folds(&p->c[a->previous], a, c) || folds(a, c, &p->c[c->next]))) {
        return false;
    }
    return demand == ANY_CONVEX || !is_occupied(p, a, b, c, demand != TOUCHED);
}

static void emit(cut *p, uint32_t a, uint32_t b, uint32_t c) {
    uint32_t *to = p->triangles + 3 * p->made++;
    to[0] = a;
    to[1] = b;
    to[2] = c;
}

static void cut_ear(cut *p, uint32_t ear, int demand) {
    corner *b = &p->c[ear];
    if (demand != FLAT) {
        emit(p, b->previous, ear, b->next);
    }
    p->simple = p->simple && demand < ANY_CONVEX;
    p->c[b->previous].next = b->next;
    p->c[b->next].previous = b->previous;
    b->gone = true;
    --p->left;
}

/* Cuts the last three corners, in their order around the polygon. */
static void cut_last(cut *p) {
    uint32_t rest[3];
    size_t found = 0;
    for (uint32_t i = 0; i < p->count && found < 3; ++i) {
        if (!p->c[i].gone) {
            rest[found++] = i;
        }
    }
    const double turn = orient(&p->c[rest[0]], &p->c[rest[1]], &p->c[rest[2]]);
    if (turn != 0.0) {
        emit(p, rest[0], rest[1], rest[2]);
    }
    p->simple = p->simple && turn >= 0.0;
}

static vsh_result cut_ears(cut *p, vsh_error *error) {
    enum { EARS_A_POLL = 8192 };
    size_t next_poll = EARS_A_POLL;
    uint32_t ear = 0;
    p->left = p->count;
    while (p->left > 3) {
        int demand = CLEAN;
        for (size_t passed = 0; !is_ear(p, ear, demand); ear = p->c[ear].next) {
            if (++passed == p->left) {
                passed = 0;
                ++demand;
            }
            if (p->tried >= next_poll) {
                next_poll = p->tried + EARS_A_POLL;
                VSHI_TRY(vshi_job_check(p->job, error));
            }
        }
        const uint32_t next = p->c[ear].next;
        cut_ear(p, ear, demand);
        ear = next;
    }
    cut_last(p);
    return VSH_OK;
}

/* Cuts a quad along the diagonal from the first corner, or from one that is not convex. Returns false if that
 * gives no two triangles. */
static bool cut_quad(cut *p) {
    const corner *c = p->c;
    uint32_t start = 0;
    for (uint32_t i = 0; i < 4; ++i) {
        start = orient(&c[(i + 3) % 4], &c[i], &c[(i + 1) % 4]) > 0.0 ? start : i;
    }
    const uint32_t second = (start + 1) % 4, third = (start + 2) % 4, fourth = (start + 3) % 4;
    if (!(orient(&c[start], &c[second], &c[third]) > 0.0 && orient(&c[start], &c[third], &c[fourth]) > 0.0)) {
        return false;
    }
    emit(p, start, second, third);
    emit(p, start, third, fourth);
    return true;
}

static void cut_fan(cut *p, const float *positions) {
    for (uint32_t i = 1; i + 1 < p->count; ++i) {
        double normal[3];
        const uint32_t three[3] = {p->vertices[0], p->vertices[i], p->vertices[i + 1]};
        newell(positions, three, 3, normal);
        p->simple = p->simple && normal[0] == 0.0 && normal[1] == 0.0 && normal[2] == 0.0;
        emit(p, 0, i, i + 1);
    }
}

static vsh_result reserve(vshi_face_cutter *cutter, size_t count, vsh_error *error) {
    if (count <= cutter->capacity) {
        return VSH_OK;
    }
    free(cutter->reflex);
    free(cutter->corners);
    cutter->reflex = NULL;
    cutter->capacity = 0;
    const size_t capacity = count + count / 2;
    VSHI_TRY(VSHI_ALLOCATE(cutter->corners, capacity, "polygon", error));
    VSHI_TRY(VSHI_ALLOCATE(cutter->reflex, capacity, "polygon", error));
    cutter->capacity = capacity;
    return VSH_OK;
}

static vsh_result cut_polygon(vshi_face_cutter *cutter, const uint32_t *vertices, size_t count,
                              uint32_t *triangles, size_t *made, vsh_error *error) {
    VSHI_TRY(reserve(cutter, count, error));
    cut p = {.c = cutter->corners,
             .reflex = cutter->reflex,
             .count = count,
             .job = cutter->job,
             .vertices = vertices,
             .triangles = triangles,
             .simple = true};
    vsh_result result = VSH_OK;
    if (count == 3) {
        emit(&p, 0, 1, 2);
    } else if (!project(&p, cutter->positions)) {
        cut_fan(&p, cutter->positions);
    } else if (count != 4 || !cut_quad(&p)) {
        find_reflex(&p);
        result = cut_ears(&p, error);
    }
    *made = p.made;
    cutter->crossing += !p.simple;
    return result;
}

/* Turns triangles whose first corner is that of the triangle before. Assimp did so, because it encodes
 * polygons as fans; bakes keep their bits. */
static void turn_fan(vshi_face_cutter *cutter, uint32_t *triangles, size_t count) {
    if (cutter->begun && triangles[0] == cutter->last_first) {
        uint32_t *t = triangles;
        const uint32_t first[3] = {t[2], t[0], t[1]};
        memcpy(t, first, sizeof first);
        if (count == 2) {
            const uint32_t second[3] = {t[4], t[5], t[3]};
            memcpy(t + 3, second, sizeof second);
        }
    }
    cutter->last_first = triangles[0];
    cutter->begun = true;
}

static void name_vertices(const uint32_t *corners, uint32_t *triangles, size_t count) {
    for (size_t i = 0; i < 3 * count; ++i) {
        triangles[i] = corners[triangles[i]];
    }
}

vsh_result vshi_face_cut(vshi_face_cutter *cutter, const uint32_t *corners, size_t count, uint32_t *triangles,
                         size_t *made, vsh_error *error) {
    enum { FACES_A_POLL = 1 << 14 };
    const bool apart = cutter->apart && count > 3;
    *made = 0;
    if (count < 3) {
        return VSH_OK;
    }
    if (cutter->faces++ % FACES_A_POLL == 0) {
        VSHI_TRY(vshi_job_check(cutter->job, error));
    }
    VSHI_TRY(cut_polygon(cutter, corners, count, triangles, made, error));
    if (apart) {
        cutter->begun = false;
    } else {
        name_vertices(corners, triangles, *made);
    }
    if (count <= 4 && cutter->turns && *made > 0) {
        turn_fan(cutter, triangles, *made);
    }
    for (size_t i = 0; count > 4 && i < *made; ++i) {
        turn_fan(cutter, triangles + 3 * i, 1);
    }
    if (apart) {
        name_vertices(corners, triangles, *made);
    }
    return VSH_OK;
}

void vshi_face_cutter_end(vshi_face_cutter *cutter, const vsh_run *run, const char *path, const char *name) {
    free(cutter->reflex);
    free(cutter->corners);
    if (cutter->crossing > 0) {
        vshi_warn(run,
                  "%s: mesh '%s': edges of %zu polygons cross, so their triangles are guessed; triangulate "
                  "before the export",
                  path, name, cutter->crossing);
    }
}

size_t vshi_faces_count_triangles(const vshi_face_run *runs, size_t count, bool *triangles) {
    size_t most = 0;
    *triangles = true;
    for (size_t i = 0; i < count; ++i) {
        most += runs[i].size >= 3 ? runs[i].faces * (runs[i].size - 2) : 0;
        *triangles = *triangles && runs[i].size == 3;
    }
    return most;
}

vsh_result vshi_faces_cut(vshi_face_cutter *cutter, const vshi_face_run *runs, size_t count,
                          const uint32_t *corners, uint32_t *triangles, size_t *made, vsh_error *error) {
    bool plain;
    size_t faces = 0;
    *made = 0;
    for (size_t i = 0; i < count; ++i) {
        faces += runs[i].faces;
    }
    cutter->turns = !cutter->apart && vshi_faces_count_triangles(runs, count, &plain) > faces;
    for (size_t i = 0; i < count; ++i) {
        for (size_t f = 0; f < runs[i].faces; ++f, corners += runs[i].size) {
            size_t more;
            VSHI_TRY(vshi_face_cut(cutter, corners, runs[i].size, triangles + 3 * *made, &more, error));
            *made += more;
        }
    }
    return VSH_OK;
}

void vshi_faces_free(vshi_faces *faces) {
    free(faces->runs);
    free(faces->corners);
    *faces = (vshi_faces){0};
}
