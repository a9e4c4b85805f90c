/* Charts laid out flat: by least squares conformal maps, then as rigid as possible. */
#include "unwrap/charts.h"

#include "base/memory.h"
#include "geometry/edges.h"

#include <complex.h>
#include <stdlib.h>

#ifndef CMPLX /* glibc 2.36 defines it for gcc only */
#define CMPLX(x, y) __builtin_complex((double)(x), (double)(y))
#endif

static const char what[] = "laying out a chart";

/* Cosine of 0.1°: triangles closer to the mean normal are projected, stretched by 1 + 2e-6 at most. */
static const double PLANAR = 0.9999985;
static const double LEAST_COTANGENT = 0.02; /* of ARAP's weights: negative ones would fold triangles */
static const double GOOD = 1.002;           /* stretch that needs no more iterations */
static const double GAIN = 1e-3;            /* of stretch, by an iteration that is worth another */

enum { ITERATIONS = 10 };

/* --- Hermitian systems over the edges of a mesh, with a complex unknown at each vertex.
 * Up-looking LDLᴴ: each row of the factor is solved from the rows before it. The elimination tree gives the
 * pattern (Liu, "The role of elimination trees in sparse factorization", 1990). */

/* The language's own product is slower, as it checks for NaN. */
static double complex multiply(double complex a, double complex b) {
    return CMPLX(creal(a) * creal(b) - cimag(a) * cimag(b), creal(a) * cimag(b) + cimag(a) * creal(b));
}

/* Rows and columns stand in the order in which they are eliminated. */
typedef struct sparse {
    uint32_t count;
    uint32_t *order;  /* [count]: the row of each vertex; one block with all arrays but `column`, `value`,
                         `factor_row` and `factor` */
    uint32_t *begin;  /* [count + 1] in `column`: entries of each row left of the diagonal */
    uint32_t *column; /* ascending in each row */
    double complex *value;
    double *diagonal;
    uint32_t *parent;       /* of the elimination tree */
    uint32_t *factor_begin; /* [count + 1] in `factor_row`: entries of each column of the factor */
    uint32_t *factor_row;
    double complex *factor;
    double *pivot;
    double complex *work;
    uint32_t *marks, *stack, *filled;
} sparse;

/* The vertices beside vertex v: others[2 first[v]] … others[end[v] - 1], ascending, each once. */
typedef struct adjacency {
    uint32_t *first;   /* [vertex_count + 2] in `corners`; one block with the arrays below */
    uint32_t *corners; /* [3 triangles], by vertex */
    uint32_t *end;     /* [vertex_count] */
    uint32_t *others;  /* [6 triangles] */
} adjacency;

/* --- the order of elimination: nested dissection (George, "Nested dissection of a regular finite element
 * mesh", 1973) by planes through space */

enum { FEW = 12, DEEPEST = 64 };

typedef struct part {
    uint32_t begin, end, row; /* vertices in the list; the first row that is theirs */
    int depth;
} part;

typedef struct dissecting {
    const adjacency *neighbours;
    const vshi_vec *place;
    uint32_t *list; /* vertices */
    uint32_t *side; /* [count]: the part that a vertex is in, times two, and whether it is beyond the plane */
    uint32_t *other; /* [count]: room */
    uint32_t *order;
} dissecting;

static double along(vshi_vec p, int axis) {
    return axis == 0 ? p.x : axis == 1 ? p.y : p.z;
}

/* The longest side of the part's box, and the mean along it. */
static int find_plane(const dissecting *d, const part *p, double *middle) {
    double low[3], high[3], sum[3];
    for (int k = 0; k < 3; ++k) {
        low[k] = INFINITY;
        high[k] = -INFINITY;
        sum[k] = 0.0;
    }
    for (uint32_t i = p->begin; i < p->end; ++i) {
        for (int k = 0; k < 3; ++k) {
            const double x = along(d->place[d->list[i]], k);
            low[k] = x < low[k] ? x : low[k];
            high[k] = x > high[k] ? x : high[k];
            sum[k] += x;
        }
    }
    int axis = 0;
    for (int k = 1; k < 3; ++k) {
        axis = high[k] - low[k] > high[axis] - low[axis] ? k : axis;
    }
    *middle = sum[axis] / (double)(p->end - p->begin);
    return axis;
}

static void number(dissecting *d, const part *p) {
    for (uint32_t i = p->begin; i < p->end; ++i) {
        d->order[d->list[i]] = p->row + (i - p->begin);
    }
}

/* Sorts a part's vertices into those before a plane, those beyond it, and those before it that touch these.
 * `turned` exchanges before and beyond, for the tip of a fan that touches everything. Returns false if the
 * plane parts nothing. */
static bool cut(dissecting *d, const part *p, uint32_t tag, bool turned, part halves[2]) {
    double middle;
    const int axis = find_plane(d, p, &middle);
    for (uint32_t i = p->begin; i < p->end; ++i) {
        const uint32_t v = d->list[i];
        d->side[v] = 2 * tag + ((along(d->place[v], axis) > middle) != turned);
    }
    const adjacency *a = d->neighbours;
    uint32_t near = p->begin, beyond = 0, between = p->end;
    for (uint32_t i = p->begin; i < p->end; ++i) {
        const uint32_t v = d->list[i];
        bool touches = false;
        for (uint32_t n = 2 * a->first[v]; d->side[v] == 2 * tag && n < a->end[v] && !touches; ++n) {
            touches = d->side[a->others[n]] == 2 * tag + 1;
        }
        if (touches) {
            d->other[--between] = v;
        } else if (d->side[v] == 2 * tag) {
            d->other[near++] = v;
        } else {
            d->list[p->begin + beyond++] = v; /* at or before the vertex that was read */
        }
    }
    if (near == p->begin || beyond == 0) {
        uint32_t at = p->begin + beyond; /* the list keeps all its vertices */
        for (uint32_t i = p->begin; i < p->end; ++i) {
            if (i < near || i >= between) {
                d->list[at++] = d->other[i];
            }
        }
        return false;
    }
    for (uint32_t i = 0; i < beyond; ++i) {
        d->other[near + i] = d->list[p->begin + i];
    }
    for (uint32_t i = p->begin; i < p->end; ++i) {
        d->list[i] = d->other[i];
    }
    halves[0] = (part){p->begin, near, p->row, p->depth + 1};
    halves[1] = (part){near, near + beyond, p->row + (near - p->begin), p->depth + 1};
    const part border = {between, p->end, p->row + (between - p->begin), 0};
    number(d, &border);
    for (uint32_t i = between; i < p->end; ++i) {
        d->side[d->list[i]] = UINT32_MAX; /* no longer in a part */
    }
    return true;
}

/* order[v] is the row of vertex v. */
static vsh_result dissect(const adjacency *neighbours, const vshi_vec *place, uint32_t count, uint32_t *order,
                          vsh_error *error) {
    dissecting d = {.neighbours = neighbours, .place = place, .order = order};
    const vshi_array arrays[] = {VSHI_ARRAY(d.list, count), VSHI_ARRAY(d.side, count),
                                 VSHI_ARRAY(d.other, count)};
    part stack[DEEPEST + 2];
    size_t waiting = 0;
    uint32_t tag = 0;
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, what, error));
    for (uint32_t v = 0; v < count; ++v) {
        d.list[v] = v;
        d.side[v] = UINT32_MAX;
    }
    stack[waiting++] = (part){0, count, 0, 0};
    while (waiting > 0) {
        const part p = stack[--waiting];
        if (p.end - p.begin > FEW && p.depth < DEEPEST &&
            (cut(&d, &p, tag, false, stack + waiting) || cut(&d, &p, tag, true, stack + waiting))) {
            waiting += 2;
        } else {
            number(&d, &p);
        }
        ++tag;
    }
    free(d.list);
    return VSH_OK;
}

/* --- the system */

/* Each vertex in turn is added to the lists of its neighbours. So lists ascend without being sorted. */
static vsh_result find_neighbours(const vshi_patch *p, adjacency *a, vsh_error *error) {
    const uint32_t vertex_count = p->vertex_count;
    const size_t corners = 3 * (size_t)p->count;
    const vshi_array arrays[] = {VSHI_ARRAY(a->first, (size_t)vertex_count + 2),
                                 VSHI_ARRAY(a->corners, corners), VSHI_ARRAY(a->end, vertex_count),
                                 VSHI_ARRAY(a->others, 2 * corners)};
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, what, error));
    vshi_list_groups(p->corner[0], corners, vertex_count, a->first, a->corners);
    for (uint32_t v = 0; v < vertex_count; ++v) {
        a->end[v] = 2 * a->first[v];
    }
    for (uint32_t v = 0; v < vertex_count; ++v) {
        for (uint32_t i = 2 * a->first[v]; i < 2 * a->first[v + 1]; ++i) {
            const uint32_t corner = a->corners[i / 2], w = p->corner[corner / 3][(corner + 1 + i % 2) % 3];
            if (a->end[w] == 2 * a->first[w] || a->others[a->end[w] - 1] != v) {
                a->others[a->end[w]++] = v;
            }
        }
    }
    return VSH_OK;
}

static vsh_result fill_rows(sparse *m, const adjacency *a, vsh_error *error) {
    uint32_t *vertex = m->marks, *end = m->filled; /* not needed yet */
    for (uint32_t v = 0; v < m->count; ++v) {
        vertex[m->order[v]] = v;
        for (uint32_t i = 2 * a->first[v]; i < a->end[v]; ++i) {
            m->begin[m->order[v] + 1] += m->order[a->others[i]] < m->order[v];
        }
    }
    for (uint32_t r = 0; r < m->count; ++r) {
        end[r] = m->begin[r];
        m->begin[r + 1] += m->begin[r];
    }
    const vshi_array arrays[] = {VSHI_ARRAY(m->column, m->begin[m->count]),
                                 VSHI_ARRAY(m->value, m->begin[m->count])};
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, what, error));
    for (uint32_t column = 0; column < m->count; ++column) {
        const uint32_t v = vertex[column];
        for (uint32_t i = 2 * a->first[v]; i < a->end[v]; ++i) {
            const uint32_t row = m->order[a->others[i]];
            if (row > column) {
                m->column[end[row]++] = column;
            }
        }
    }
    return VSH_OK;
}

/* The elimination tree, and how many entries each column of the factor has. */
static vsh_result plan_factor(sparse *m, vsh_error *error) {
    for (uint32_t row = 0; row < m->count; ++row) {
        m->parent[row] = VSHI_NONE;
        m->marks[row] = row;
        for (uint32_t i = m->begin[row]; i < m->begin[row + 1]; ++i) {
            for (uint32_t c = m->column[i]; m->marks[c] != row; c = m->parent[c]) {
                if (m->parent[c] == VSHI_NONE) {
                    m->parent[c] = row;
                }
                ++m->factor_begin[c + 1];
                m->marks[c] = row;
            }
        }
    }
    size_t entries = 0;
    for (uint32_t c = 0; c < m->count; ++c) {
        entries += m->factor_begin[c + 1];
        if (entries >= UINT32_MAX) {
            return vshi_fail(error, VSH_ERROR_MEMORY, "%s: more than 2^32 entries", what);
        }
        m->factor_begin[c + 1] = (uint32_t)entries;
    }
    const vshi_array arrays[] = {VSHI_ARRAY(m->factor_row, entries), VSHI_ARRAY(m->factor, entries)};
    return VSHI_ALLOCATE_BLOCK(arrays, what, error);
}

/* A system whose entries are the edges of the patch; all values are 0. Errors: VSH_ERROR_MEMORY. Free with
 * sparse_free(), after a failure too. */
static vsh_result sparse_make(const vshi_patch *p, sparse *m, vsh_error *error) {
    const uint32_t vertex_count = p->vertex_count;
    *m = (sparse){.count = vertex_count};
    adjacency a = {NULL, NULL, NULL, NULL};
    vsh_result result;
    const vshi_array arrays[] = {VSHI_ARRAY(m->order, vertex_count),
                                 VSHI_ARRAY(m->begin, (size_t)vertex_count + 1),
                                 VSHI_ARRAY(m->diagonal, vertex_count),
                                 VSHI_ARRAY(m->parent, vertex_count),
                                 VSHI_ARRAY(m->factor_begin, (size_t)vertex_count + 1),
                                 VSHI_ARRAY(m->pivot, vertex_count),
                                 VSHI_ARRAY(m->work, vertex_count),
                                 VSHI_ARRAY(m->marks, vertex_count),
                                 VSHI_ARRAY(m->stack, vertex_count),
                                 VSHI_ARRAY(m->filled, vertex_count)};
    VSHI_TRY_DONE(VSHI_ALLOCATE_BLOCK(arrays, what, error));
    VSHI_TRY_DONE(find_neighbours(p, &a, error));
    VSHI_TRY_DONE(dissect(&a, p->place, vertex_count, m->order, error));
    VSHI_TRY_DONE(fill_rows(m, &a, error));
    VSHI_TRY_DONE(plan_factor(m, error));
done:
    free(a.first);
    return result;
}

static void sparse_free(sparse *m) {
    free(m->factor_row);
    free(m->column);
    free(m->order);
}

static void sparse_clear(sparse *m) {
    memset(m->diagonal, 0, m->count * sizeof *m->diagonal);
    if (m->begin[m->count] > 0) {
        memset(m->value, 0, m->begin[m->count] * sizeof *m->value);
    }
}

/* Adds to the entry of row a, column b, and the conjugate to its mirror image; a and b are an edge's
 * vertices. */
static void sparse_add(sparse *m, uint32_t a, uint32_t b, double complex value) {
    uint32_t row = m->order[a], column = m->order[b];
    if (row < column) {
        const uint32_t kept = row;
        row = column;
        column = kept;
        value = conj(value);
    }
    uint32_t at = m->begin[row], end = m->begin[row + 1];
    while (m->column[at] != column) { /* it is there */
        const uint32_t middle = at + (end - at) / 2;
        if (m->column[middle] <= column) {
            at = middle;
        } else {
            end = middle;
        }
    }
    m->value[at] += value;
}

static void sparse_add_diagonal(sparse *m, uint32_t vertex, double value) {
    m->diagonal[m->order[vertex]] += value;
}

/* Fixes a vertex at a value, before factoring: its row becomes the identity's, and its terms in other rows
 * move to the right sides. */
static void sparse_pin(sparse *m, uint32_t vertex, double complex value, double complex *right) {
    const uint32_t pinned = m->order[vertex];
    for (uint32_t v = 0; v < m->count; ++v) { /* `work` holds the right side by rows */
        m->work[m->order[v]] = right[v];
    }
    for (uint32_t i = m->begin[pinned]; i < m->begin[pinned + 1]; ++i) {
        m->work[m->column[i]] -= multiply(conj(m->value[i]), value);
        m->value[i] = 0.0;
    }
    for (uint32_t row = pinned + 1; row < m->count; ++row) {
        for (uint32_t i = m->begin[row]; i < m->begin[row + 1]; ++i) {
            if (m->column[i] == pinned) {
                m->work[row] -= multiply(m->value[i], value);
                m->value[i] = 0.0;
            }
        }
    }
    m->diagonal[pinned] = 1.0;
    m->work[pinned] = value;
    for (uint32_t v = 0; v < m->count; ++v) {
        right[v] = m->work[m->order[v]];
    }
}

/* Lists the columns of a row of the factor, each before the columns that depend on it. They begin at the
 * returned place of `stack`. */
static uint32_t find_row_pattern(sparse *m, uint32_t row) {
    uint32_t top = m->count;
    m->marks[row] = row;
    for (uint32_t i = m->begin[row]; i < m->begin[row + 1]; ++i) {
        uint32_t length = 0;
        for (uint32_t c = m->column[i]; m->marks[c] != row; c = m->parent[c]) {
            m->stack[length++] = c;
            m->marks[c] = row;
        }
        while (length > 0) {
            m->stack[--top] = m->stack[--length];
        }
    }
    return top;
}

/* False if the matrix is not positive definite, within rounding. */
static bool sparse_factor(sparse *m) {
    static const double LEAST = 1e-13; /* pivot over the diagonal's old value */
    for (uint32_t row = 0; row < m->count; ++row) {
        m->work[row] = 0.0;
        m->marks[row] = VSHI_NONE;
        m->filled[row] = 0;
    }
    for (uint32_t row = 0; row < m->count; ++row) {
        const uint32_t top = find_row_pattern(m, row);
        for (uint32_t i = m->begin[row]; i < m->begin[row + 1]; ++i) {
            m->work[m->column[i]] = conj(m->value[i]);
        }
        double pivot = m->diagonal[row];
        for (uint32_t s = top; s < m->count; ++s) {
            const uint32_t c = m->stack[s], begin = m->factor_begin[c], end = begin + m->filled[c];
            const double complex y = m->work[c];
            m->work[c] = 0.0;
            for (uint32_t i = begin; i < end; ++i) {
                m->work[m->factor_row[i]] -= multiply(m->factor[i], y);
            }
            const double complex l = conj(y) / m->pivot[c];
            pivot -= creal(multiply(y, l));
            m->factor_row[end] = row;
            m->factor[end] = l;
            ++m->filled[c];
        }
        m->pivot[row] = pivot;
        if (!(pivot > LEAST * m->diagonal[row]) || !isfinite(pivot)) {
            return false;
        }
    }
    return true;
}

/* Solves for one right side [count], by vertex, in place. */
static void sparse_solve(const sparse *m, double complex *right) {
    double complex *x = m->work;
    for (uint32_t v = 0; v < m->count; ++v) {
        x[m->order[v]] = right[v];
    }
    for (uint32_t c = 0; c < m->count; ++c) {
        const double complex y = x[c];
        for (uint32_t i = m->factor_begin[c]; i < m->factor_begin[c + 1]; ++i) {
            x[m->factor_row[i]] -= multiply(m->factor[i], y);
        }
    }
    for (uint32_t c = m->count; c-- > 0;) {
        double complex y = x[c] * (1.0 / m->pivot[c]);
        for (uint32_t i = m->factor_begin[c]; i < m->factor_begin[c + 1]; ++i) {
            y -= multiply(conj(m->factor[i]), x[m->factor_row[i]]);
        }
        x[c] = y;
    }
    for (uint32_t v = 0; v < m->count; ++v) {
        right[v] = x[m->order[v]];
    }
}

/* --- a chart */

typedef struct laying {
    vshi_patch *patch;
    double complex (*flat)[3]; /* [count]: corners of each triangle in its own plane, the first at 0; one
                                  block with `x` and `best` */
    sparse system;
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

/* 8 A² L2² of a triangle with area A in UVs: the Dirichlet energy of the map from UVs to the surface, by
 * cotangents (Pinkall and Polthier, 1993). */
static double find_energy(const vshi_patch *p, uint32_t i) {
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
        squares += find_energy(p, i) / (2.0 * doubled * doubled) * p->surface->area[p->triangles[i]];
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
        sparse_add_diagonal(&l->system, corner[j], scalar_product(w[j], w[j]) / doubled);
        sparse_add(&l->system, corner[j], corner[k], multiply(conj(w[j]), w[k]) * (1.0 / doubled));
    }
}

/* Two vertices far from each other: the ends of the longest side of the box. */
static void find_pins(const vshi_patch *p, uint32_t pins[2]) {
    double longest = -1.0;
    for (int axis = 0; axis < 3; ++axis) {
        uint32_t low = 0, high = 0;
        double least = INFINITY, most = -INFINITY;
        for (uint32_t v = 0; v < p->vertex_count; ++v) {
            const double x = along(p->place[v], axis);
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
    sparse_solve(&l->system, l->x);
    for (uint32_t v = 0; v < l->patch->vertex_count; ++v) {
        l->patch->uv[v][0] = creal(l->x[v]);
        l->patch->uv[v][1] = cimag(l->x[v]);
    }
}

static bool lay_conformal(laying *l) {
    vshi_patch *p = l->patch;
    uint32_t pins[2] = {0, 0};
    find_pins(p, pins);
    sparse_clear(&l->system);
    for (uint32_t i = 0; i < p->count; ++i) {
        add_conformal(l, i);
    }
    memset(l->x, 0, p->vertex_count * sizeof *l->x);
    sparse_pin(&l->system, pins[0], 0.0, l->x);
    sparse_pin(&l->system, pins[1], vshi_length(vshi_sub(p->place[pins[1]], p->place[pins[0]])), l->x);
    if (!sparse_factor(&l->system)) {
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
    sparse_clear(&l->system);
    for (uint32_t i = 0; i < p->count; ++i) {
        for (int k = 0; k < 3; ++k) {
            const uint32_t b = p->corner[i][(k + 1) % 3], c = p->corner[i][(k + 2) % 3];
            const double weight = cotangent(l->flat[i], k);
            sparse_add_diagonal(&l->system, b, weight);
            sparse_add_diagonal(&l->system, c, weight);
            sparse_add(&l->system, b, c, -weight);
        }
    }
    memset(l->x, 0, p->vertex_count * sizeof *l->x);
    sparse_pin(&l->system, 0, 0.0, l->x); /* any place will do */
    return sparse_factor(&l->system);
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
            turn += multiply(now, conj(edge[k])) * weight[k];
        }
        const double length = sqrt(scalar_product(turn, turn));
        turn = length > 0.0 ? turn * (1.0 / length) : 1.0;
        for (int k = 0; k < 3; ++k) {
            const uint32_t b = p->corner[i][(k + 1) % 3], c = p->corner[i][(k + 2) % 3];
            const double complex to = multiply(turn, edge[k]) * weight[k];
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

/* Iterates, from the result of LSCM, until a step gains little. */
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
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, what, error));
    VSHI_TRY(sparse_make(p, &l->system, error));
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
        sparse_free(&l.system);
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
