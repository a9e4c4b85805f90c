/* Up-looking LDLᴴ: each row of the factor by a triangular solve with the rows before, whose pattern is read
 * off the elimination tree (Liu, "The role of elimination trees in sparse factorization", 1990). */
#include "unwrap/sparse.h"

#include "base/memory.h"
#include "mesh/weld.h"

#include <stdlib.h>

static const char what[] = "a chart's equations";

#define NONE UINT32_MAX

/* The vertices beside vertex v: others[2 first[v]] … others[end[v] - 1], ascending, each once. */
typedef struct adjacency {
    uint32_t *first;   /* [vertex_count + 2] in `corners` */
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

/* `turned`: before is beyond, for where one vertex beyond, the tip of a fan, touches all that is before.
 * Sorts a part's vertices into those before a plane, those beyond it, and those before it that touch them,
 * which come last. Returns false where that parts nothing. */
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
        uint32_t at = p->begin +
                      beyond; /* all that is before it touches it, or nothing is: the list as a whole again */
        for (uint32_t i = p->begin; i < near; ++i) {
            d->list[at++] = d->other[i];
        }
        for (uint32_t i = between; i < p->end; ++i) {
            d->list[at++] = d->other[i];
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
        d->side[d->list[i]] = UINT32_MAX; /* in no part any more */
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
    vsh_result result;
    VSHI_TRY_DONE(VSHI_ALLOCATE_ALL(arrays, what, error));
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
done:
    free(d.other);
    free(d.side);
    free(d.list);
    return result;
}

/* --- the system */

/* Each vertex is listed at those beside it, in its turn: so lists ascend, and no vertex of many edges makes
 * sorting slow. */
static vsh_result find_neighbours(const uint32_t (*triangles)[3], uint32_t count, uint32_t vertex_count,
                                  adjacency *a, vsh_error *error) {
    const size_t corners = 3 * (size_t)count;
    const vshi_array arrays[] = {VSHI_ARRAY(a->first, (size_t)vertex_count + 2),
                                 VSHI_ARRAY(a->corners, corners), VSHI_ARRAY(a->end, vertex_count),
                                 VSHI_ARRAY(a->others, 2 * corners)};
    VSHI_TRY(VSHI_ALLOCATE_ALL(arrays, what, error));
    vshi_list_groups(triangles[0], corners, vertex_count, a->first, a->corners);
    for (uint32_t v = 0; v < vertex_count; ++v) {
        a->end[v] = 2 * a->first[v];
    }
    for (uint32_t v = 0; v < vertex_count; ++v) {
        for (uint32_t i = 2 * a->first[v]; i < 2 * a->first[v + 1]; ++i) {
            const uint32_t corner = a->corners[i / 2], w = triangles[corner / 3][(corner + 1 + i % 2) % 3];
            if (a->end[w] == 2 * a->first[w] || a->others[a->end[w] - 1] != v) {
                a->others[a->end[w]++] = v;
            }
        }
    }
    return VSH_OK;
}

static vsh_result fill_rows(vshi_sparse *m, const adjacency *a, vsh_error *error) {
    uint32_t *vertex = m->marks, *end = m->filled; /* which are not needed yet */
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
    const uint32_t entries = m->begin[m->count];
    VSHI_TRY(vshi_allocate((void **)&m->column, entries, sizeof *m->column, what, error));
    VSHI_TRY(vshi_allocate((void **)&m->value, entries, sizeof *m->value, what, error));
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
static vsh_result plan_factor(vshi_sparse *m, vsh_error *error) {
    for (uint32_t row = 0; row < m->count; ++row) {
        m->parent[row] = NONE;
        m->marks[row] = row;
        for (uint32_t i = m->begin[row]; i < m->begin[row + 1]; ++i) {
            for (uint32_t c = m->column[i]; m->marks[c] != row; c = m->parent[c]) {
                if (m->parent[c] == NONE) {
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
    VSHI_TRY(vshi_allocate((void **)&m->factor_row, entries, sizeof *m->factor_row, what, error));
    return vshi_allocate((void **)&m->factor, entries, sizeof *m->factor, what, error);
}

vsh_result vshi_sparse_make(const uint32_t (*triangles)[3], uint32_t count, const vshi_vec *place,
                            uint32_t vertex_count, vshi_sparse *m, vsh_error *error) {
    *m = (vshi_sparse){.count = vertex_count};
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
    VSHI_TRY_DONE(VSHI_ALLOCATE_ALL(arrays, what, error));
    VSHI_TRY_DONE(find_neighbours(triangles, count, vertex_count, &a, error));
    VSHI_TRY_DONE(dissect(&a, place, vertex_count, m->order, error));
    VSHI_TRY_DONE(fill_rows(m, &a, error));
    VSHI_TRY_DONE(plan_factor(m, error));
done:
    free(a.others);
    free(a.end);
    free(a.corners);
    free(a.first);
    return result;
}

void vshi_sparse_free(vshi_sparse *m) {
    free(m->filled);
    free(m->stack);
    free(m->marks);
    free(m->work);
    free(m->pivot);
    free(m->factor);
    free(m->factor_row);
    free(m->factor_begin);
    free(m->parent);
    free(m->diagonal);
    free(m->value);
    free(m->column);
    free(m->begin);
    free(m->order);
    *m = (vshi_sparse){0};
}

void vshi_sparse_clear(vshi_sparse *m) {
    memset(m->diagonal, 0, m->count * sizeof *m->diagonal);
    if (m->begin[m->count] > 0) {
        memset(m->value, 0, m->begin[m->count] * sizeof *m->value);
    }
}

void vshi_sparse_add(vshi_sparse *m, uint32_t a, uint32_t b, double complex value) {
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

void vshi_sparse_add_diagonal(vshi_sparse *m, uint32_t vertex, double value) {
    m->diagonal[m->order[vertex]] += value;
}

void vshi_sparse_pin(vshi_sparse *m, uint32_t vertex, double complex value, double complex *right) {
    const uint32_t pinned = m->order[vertex];
    for (uint32_t v = 0; v < m->count; ++v) { /* `work` holds the right side by rows for a while */
        m->work[m->order[v]] = right[v];
    }
    for (uint32_t i = m->begin[pinned]; i < m->begin[pinned + 1]; ++i) {
        m->work[m->column[i]] -= vshi_times(conj(m->value[i]), value);
        m->value[i] = 0.0;
    }
    for (uint32_t row = pinned + 1; row < m->count; ++row) {
        for (uint32_t i = m->begin[row]; i < m->begin[row + 1]; ++i) {
            if (m->column[i] == pinned) {
                m->work[row] -= vshi_times(m->value[i], value);
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

/* The columns that row `row` of the factor has entries in, each before those that depend on it, from the
 * returned place in `stack` on. */
static uint32_t row_pattern(vshi_sparse *m, uint32_t row) {
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

bool vshi_sparse_factor(vshi_sparse *m) {
    static const double LEAST = 1e-13; /* of a pivot, against what the diagonal was */
    for (uint32_t row = 0; row < m->count; ++row) {
        m->work[row] = 0.0;
        m->marks[row] = NONE;
        m->filled[row] = 0;
    }
    for (uint32_t row = 0; row < m->count; ++row) {
        const uint32_t top = row_pattern(m, row);
        for (uint32_t i = m->begin[row]; i < m->begin[row + 1]; ++i) {
            m->work[m->column[i]] = conj(m->value[i]);
        }
        double pivot = m->diagonal[row];
        for (uint32_t s = top; s < m->count; ++s) {
            const uint32_t c = m->stack[s], begin = m->factor_begin[c], end = begin + m->filled[c];
            const double complex y = m->work[c];
            m->work[c] = 0.0;
            for (uint32_t i = begin; i < end; ++i) {
                m->work[m->factor_row[i]] -= vshi_times(m->factor[i], y);
            }
            const double complex l = conj(y) / m->pivot[c];
            pivot -= creal(vshi_times(y, l));
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

void vshi_sparse_solve(const vshi_sparse *m, double complex *right) {
    double complex *x = m->work;
    for (uint32_t v = 0; v < m->count; ++v) {
        x[m->order[v]] = right[v];
    }
    for (uint32_t c = 0; c < m->count; ++c) {
        const double complex y = x[c];
        for (uint32_t i = m->factor_begin[c]; i < m->factor_begin[c + 1]; ++i) {
            x[m->factor_row[i]] -= vshi_times(m->factor[i], y);
        }
    }
    for (uint32_t c = m->count; c-- > 0;) {
        double complex y = x[c] * (1.0 / m->pivot[c]);
        for (uint32_t i = m->factor_begin[c]; i < m->factor_begin[c + 1]; ++i) {
            y -= vshi_times(conj(m->factor[i]), x[m->factor_row[i]]);
        }
        x[c] = y;
    }
    for (uint32_t v = 0; v < m->count; ++v) {
        right[v] = x[m->order[v]];
    }
}
