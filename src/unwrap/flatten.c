#include "unwrap/patch.h"

#include "base/memory.h"
#include "unwrap/sparse.h"

#include <stdlib.h>

static const char what[] = "laying out a chart";

static const double PLANAR =
    0.9999985; /* cosine, 0.1°: projected along the mean, stretched by 1 + 2e-6 at most */
static const double LEAST_COTANGENT = 0.02; /* of ARAP's weights: negative ones would fold triangles */
static const double GOOD = 1.002;           /* stretch that needs no more iterations */
static const double GAIN = 1e-3;            /* that an iteration is worth */

enum { ITERATIONS = 10 };

typedef struct laying {
    vshi_patch *patch;
    double complex (*flat)[3]; /* [count]: corners of each triangle in its own plane, the first at 0 */
    vshi_sparse system;
    double complex *x;   /* [vertex_count] */
    double (*best)[2];   /* [vertex_count]: the least stretched so far */
    double best_stretch; /* INFINITY: all were folded */
} laying;

/* --- planes */

static bool project(vshi_patch *p) {
    const vshi_cut_mesh *s = p->surface;
    vshi_vec sum = {0, 0, 0}, u, v;
    for (uint32_t i = 0; i < p->count; ++i) {
        sum = vshi_add(sum, vshi_scale(s->normal[p->triangles[i]], s->area[p->triangles[i]]));
    }
    const vshi_vec normal = vshi_unit(sum);
    for (uint32_t i = 0; i < p->count; ++i) {
        if (!(vshi_dot(normal, s->normal[p->triangles[i]]) > PLANAR)) {
            return false;
        }
    }
    vshi_frame(normal, &u, &v);
    for (uint32_t i = 0; i < p->vertex_count; ++i) {
        const vshi_vec to = vshi_sub(p->place[i], p->place[0]);
        p->uv[i][0] = vshi_dot(to, u);
        p->uv[i][1] = vshi_dot(to, v);
    }
    return true;
}

/* --- measuring */

/* 8 A² L2² of a triangle, A its area in UVs: the Dirichlet energy of the map from there to the surface, by
 * cotangents (Pinkall and Polthier, 1993). */
static double energy(const vshi_patch *p, uint32_t i) {
    double sum = 0.0;
    for (int k = 0; k < 3; ++k) {
        const uint32_t a = p->corner[i][k], b = p->corner[i][(k + 1) % 3], c = p->corner[i][(k + 2) % 3];
        const vshi_vec across = vshi_sub(p->place[c], p->place[b]);
        sum += ((p->uv[b][0] - p->uv[a][0]) * (p->uv[c][0] - p->uv[a][0]) +
                (p->uv[b][1] - p->uv[a][1]) * (p->uv[c][1] - p->uv[a][1])) *
               vshi_dot(across, across);
    }
    return sum;
}

bool vshi_flatten_measure(vshi_patch *p) {
    double flat_area = 0.0, squares = 0.0;
    for (uint32_t i = 0; i < p->count; ++i) {
        const double doubled = vshi_patch_doubled_area(p, i);
        if (!(doubled > 0.0)) {
            return false;
        }
        flat_area += 0.5 * doubled;
        squares += energy(p, i) / (2.0 * doubled * doubled) * p->surface->area[p->triangles[i]];
    }
    const double stretch = sqrt(squares * flat_area) / p->area;
    const double scale = sqrt(p->area / flat_area);
    if (!isfinite(stretch) || !isfinite(scale) || !(scale > 0.0)) {
        return false;
    }
    for (uint32_t v = 0; v < p->vertex_count; ++v) {
        p->uv[v][0] *= scale;
        p->uv[v][1] *= scale;
    }
    p->stretch = stretch > 1.0 ? stretch : 1.0;
    return true;
}

/* --- least squares conformal maps */

static void flatten_triangles(laying *l) {
    const vshi_patch *p = l->patch;
    for (uint32_t i = 0; i < p->count; ++i) {
        const vshi_vec a = p->place[p->corner[i][0]], ab = vshi_sub(p->place[p->corner[i][1]], a),
                       ac = vshi_sub(p->place[p->corner[i][2]], a);
        const double length = vshi_length(ab);
        l->flat[i][0] = 0.0;
        l->flat[i][1] = length;
        l->flat[i][2] = CMPLX(vshi_dot(ab, ac) / length, vshi_length(vshi_cross(ab, ac)) / length);
    }
}

static double scalar_product(double complex a, double complex b) {
    return creal(a) * creal(b) + cimag(a) * cimag(b);
}

static void add_conformal(laying *l, uint32_t i) {
    const uint32_t *corner = l->patch->corner[i];
    const double complex *at = l->flat[i];
    const double doubled = creal(at[1]) * cimag(at[2]);
    double complex w[3];
    for (int k = 0; k < 3; ++k) {
        w[k] = at[(k + 2) % 3] - at[(k + 1) % 3];
    }
    for (int j = 0; j < 3; ++j) {
        const int k = (j + 1) % 3;
        vshi_sparse_add_diagonal(&l->system, corner[j], scalar_product(w[j], w[j]) / doubled);
        vshi_sparse_add(&l->system, corner[j], corner[k], vshi_times(conj(w[j]), w[k]) * (1.0 / doubled));
    }
}

/* Two vertices far from each other: the ends of the box's longest side. */
static void find_pins(const vshi_patch *p, uint32_t pins[2]) {
    double longest = -1.0;
    for (int axis = 0; axis < 3; ++axis) {
        uint32_t low = 0, high = 0;
        double least = INFINITY, most = -INFINITY;
        for (uint32_t v = 0; v < p->vertex_count; ++v) {
            const double x = axis == 0 ? p->place[v].x : axis == 1 ? p->place[v].y : p->place[v].z;
            if (x < least) {
                least = x;
                low = v;
            }
            if (x > most) {
                most = x;
                high = v;
            }
        }
        if (most - least > longest) {
            longest = most - least;
            pins[0] = low;
            pins[1] = high;
        }
    }
}

static void solve(laying *l) {
    vshi_sparse_solve(&l->system, l->x);
    for (uint32_t v = 0; v < l->patch->vertex_count; ++v) {
        l->patch->uv[v][0] = creal(l->x[v]);
        l->patch->uv[v][1] = cimag(l->x[v]);
    }
}

static bool lay_conformal(laying *l) {
    vshi_patch *p = l->patch;
    uint32_t pins[2] = {0, 0};
    find_pins(p, pins);
    vshi_sparse_clear(&l->system);
    for (uint32_t i = 0; i < p->count; ++i) {
        add_conformal(l, i);
    }
    memset(l->x, 0, p->vertex_count * sizeof *l->x);
    vshi_sparse_pin(&l->system, pins[0], 0.0, l->x);
    vshi_sparse_pin(&l->system, pins[1], vshi_length(vshi_sub(p->place[pins[1]], p->place[pins[0]])), l->x);
    if (!vshi_sparse_factor(&l->system)) {
        return false;
    }
    solve(l);
    return true;
}

/* --- as rigid as possible */

/* Cotangent of a triangle's angle at corner k. */
static double cotangent(const double complex at[3], int k) {
    const double value =
        scalar_product(at[(k + 1) % 3] - at[k], at[(k + 2) % 3] - at[k]) / (creal(at[1]) * cimag(at[2]));
    return value > LEAST_COTANGENT ? value : LEAST_COTANGENT;
}

static bool prepare_rigid(laying *l) {
    const vshi_patch *p = l->patch;
    vshi_sparse_clear(&l->system);
    for (uint32_t i = 0; i < p->count; ++i) {
        for (int k = 0; k < 3; ++k) {
            const uint32_t b = p->corner[i][(k + 1) % 3], c = p->corner[i][(k + 2) % 3];
            const double weight = cotangent(l->flat[i], k);
            vshi_sparse_add_diagonal(&l->system, b, weight);
            vshi_sparse_add_diagonal(&l->system, c, weight);
            vshi_sparse_add(&l->system, b, c, -weight);
        }
    }
    memset(l->x, 0, p->vertex_count * sizeof *l->x);
    vshi_sparse_pin(&l->system, 0, 0.0, l->x); /* where it lies changes nothing */
    return vshi_sparse_factor(&l->system);
}

static void step_rigid(laying *l) {
    vshi_patch *p = l->patch;
    memset(l->x, 0, p->vertex_count * sizeof *l->x);
    for (uint32_t i = 0; i < p->count; ++i) {
        const double complex *at = l->flat[i];
        double complex turn = 0.0, edge[3];
        double weight[3];
        for (int k = 0; k < 3; ++k) {
            const double *b = p->uv[p->corner[i][(k + 1) % 3]], *c = p->uv[p->corner[i][(k + 2) % 3]];
            weight[k] = cotangent(at, k);
            edge[k] = at[(k + 2) % 3] - at[(k + 1) % 3];
            const double complex now = CMPLX(c[0] - b[0], c[1] - b[1]);
            turn += vshi_times(now, conj(edge[k])) * weight[k];
        }
        const double length = sqrt(scalar_product(turn, turn));
        turn = length > 0.0 ? turn * (1.0 / length) : 1.0;
        for (int k = 0; k < 3; ++k) {
            const uint32_t b = p->corner[i][(k + 1) % 3], c = p->corner[i][(k + 2) % 3];
            const double complex to = vshi_times(turn, edge[k]) * weight[k];
            l->x[b] -= to;
            l->x[c] += to;
        }
    }
    l->x[0] = 0.0;
    solve(l);
}

static void keep_best(laying *l) {
    if (l->patch->stretch < l->best_stretch) {
        memcpy(l->best, l->patch->uv, l->patch->vertex_count * sizeof *l->best);
        l->best_stretch = l->patch->stretch;
    }
}

/* Steps from where LSCM, or a fold, left it until they gain little. */
static void lay_rigid(laying *l) {
    double before = INFINITY;
    if (!prepare_rigid(l)) {
        return;
    }
    for (int i = 0; i < ITERATIONS; ++i) {
        step_rigid(l);
        if (!vshi_flatten_measure(l->patch)) {
            continue; /* the next may unfold it */
        }
        keep_best(l);
        if (l->patch->stretch < GOOD || before - l->patch->stretch < GAIN) {
            return;
        }
        before = l->patch->stretch;
    }
}

static vsh_result lay(laying *l, vsh_error *error) {
    vshi_patch *p = l->patch;
    const vshi_array arrays[] = {VSHI_ARRAY(l->flat, p->count), VSHI_ARRAY(l->x, p->vertex_count),
                                 VSHI_ARRAY(l->best, p->vertex_count)};
    VSHI_TRY(VSHI_ALLOCATE_ALL(arrays, what, error));
    VSHI_TRY(vshi_sparse_make((const uint32_t(*)[3])p->corner, p->count, p->place, p->vertex_count,
                              &l->system, error));
    flatten_triangles(l);
    const bool laid = lay_conformal(l);
    if (laid && vshi_flatten_measure(p)) {
        keep_best(l);
    }
    if (laid && l->best_stretch > GOOD) {
        lay_rigid(l);
    }
    return VSH_OK;
}

vsh_result vshi_flatten(vshi_patch *p, double max_stretch, bool *flat, vsh_error *error) {
    *flat = false;
    if (project(p)) {
        if (!vshi_flatten_measure(p)) {
            return VSH_OK;
        }
    } else {
        laying l = {.patch = p, .best_stretch = INFINITY};
        const vsh_result result = lay(&l, error);
        const bool unfolded = isfinite(l.best_stretch);
        if (unfolded) {
            memcpy(p->uv, l.best, p->vertex_count * sizeof *l.best);
            p->stretch = l.best_stretch;
        }
        vshi_sparse_free(&l.system);
        free(l.best);
        free(l.x);
        free(l.flat);
        VSHI_TRY(result);
        if (!unfolded) {
            return VSH_OK;
        }
    }
    bool overlaps = false;
    if (p->count > 2) {
        VSHI_TRY(vshi_patch_overlaps(p, &overlaps, error));
    }
    *flat = !overlaps && !(p->stretch > max_stretch);
    return VSH_OK;
}
