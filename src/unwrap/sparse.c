/* Up-looking LDLᴴ: each row of the factor by a triangular solve with the rows before, whose pattern is read
 * off the elimination tree (Liu, "The role of elimination trees in sparse factorization", 1990). */
#include "unwrap/sparse.h"

#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>

static const char what[] = "a chart's equations";

#define NONE UINT32_MAX

/* --- the order of elimination: nested dissection (George, "Nested dissection of a regular finite element
 * mesh", 1973) by planes through space */

enum { FEW = 12, DEEPEST = 64 };

typedef struct part {
    uint32_t begin, end, row; /* vertices in the list; the first row that is theirs */
    int depth;
} part;

typedef struct dissecting {
    const uint32_t *begin, *neighbours;
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
    uint32_t near = p->begin, beyond = 0, between = p->end;
    for (uint32_t i = p->begin; i < p->end; ++i) {
        const uint32_t v = d->list[i];
        bool touches = false;
        for (uint32_t n = d->begin[v]; d->side[v] == 2 * tag && n < d->begin[v + 1] && !touches; ++n) {
            touches = d->side[d->neighbours[n]] == 2 * tag + 1;
        }
        if (touches) {
            d->other[--between] = v;
        } else if (d->side[v] == 2 * tag) {
            d->other[near++] = v;
        } else {
            d->list[p->begin + beyond++] = v; /* no further than what was read */
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

/* order[v] is the row of vertex v. neighbours[begin[v] … begin[v + 1]] are the vertices beside v. */
static vsh_result dissect(const uint32_t *begin, const uint32_t *neighbours, const vshi_vec *place,
                          uint32_t count, uint32_t *order, vsh_error *error) {
    dissecting d = {.begin = begin, .neighbours = neighbours, .place = place, .order = order};
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

/* neighbours[begin[v] …]: the other ends of each vertex's edges, ascending, each once. They are listed by
 * both ends and turned about, so that no vertex of many edges makes sorting slow. */
static vsh_result list_neighbours(const uint32_t (*triangles)[3], uint32_t count, uint32_t vertex_count,
                                  uint32_t **begin, uint32_t **neighbours, vsh_error *error) {
    uint32_t *found = NULL, *end = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)begin, (size_t)vertex_count + 1, sizeof **begin, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&end, vertex_count, sizeof *end, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&found, count, 6 * sizeof *found, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)neighbours, count, 6 * sizeof **neighbours, what, error));
    for (uint32_t i = 0; i < count; ++i) {
        for (int k = 0; k < 3; ++k) {
            (*begin)[triangles[i][k] + 1] += 2;
        }
    }
    for (uint32_t v = 0; v < vertex_count; ++v) {
        end[v] = (*begin)[v];
        (*begin)[v + 1] += (*begin)[v];
    }
    for (uint32_t i = 0; i < count; ++i) {
        for (int k = 0; k < 3; ++k) {
            found[end[triangles[i][k]]++] = triangles[i][(k + 1) % 3];
            found[end[triangles[i][k]]++] = triangles[i][(k + 2) % 3];
        }
    }
    for (uint32_t v = 0; v < vertex_count; ++v) {
        end[v] = (*begin)[v];
    }
    for (uint32_t v = 0; v < vertex_count; ++v) {
        for (uint32_t i = (*begin)[v]; i < (*begin)[v + 1]; ++i) {
            const uint32_t w = found[i];
            if (end[w] == (*begin)[w] || (*neighbours)[end[w] - 1] != v) {
                (*neighbours)[end[w]++] = v;
            }
        }
    }
    for (uint32_t v = 0, kept = 0; v < vertex_count; ++v) { /* close up */
        const uint32_t first = (*begin)[v];
        (*begin)[v] = kept;
        for (uint32_t i = first; i < end[v]; ++i) {
            (*neighbours)[kept++] = (*neighbours)[i];
        }
        if (v + 1 == vertex_count) {
            (*begin)[vertex_count] = kept;
        }
    }
done:
    free(found);
    free(end);
    return result;
}

static vsh_result fill_rows(vshi_sparse *m, const uint32_t *begin, const uint32_t *neighbours,
                            vsh_error *error) {
    uint32_t *vertex = m->marks, *end = m->filled; /* which are not needed yet */
    for (uint32_t v = 0; v < m->count; ++v) {
        vertex[m->order[v]] = v;
        for (uint32_t i = begin[v]; i < begin[v + 1]; ++i) {
            m->begin[m->order[v] + 1] += m->order[neighbours[i]] < m->order[v];
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
        for (uint32_t i = begin[v]; i < begin[v + 1]; ++i) {
            const uint32_t row = m->order[neighbours[i]];
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
    uint32_t *begin = NULL, *neighbours = NULL;
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
    VSHI_TRY_DONE(list_neighbours(triangles, count, vertex_count, &begin, &neighbours, error));
    VSHI_TRY_DONE(dissect(begin, neighbours, place, vertex_count, m->order, error));
    VSHI_TRY_DONE(fill_rows(m, begin, neighbours, error));
    VSHI_TRY_DONE(plan_factor(m, error));
done:
    free(neighbours);
    free(begin);
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

void vshi_sparse_add(vshi_sparse *m, uint32_t a, uint32_t b, vshi_complex value) {
    uint32_t row = m->order[a], column = m->order[b];
    if (row < column) {
        const uint32_t kept = row;
        row = column;
        column = kept;
        value = vshi_conjugate(value);
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
    m->value[at] = vshi_complex_add(m->value[at], value);
}

void vshi_sparse_add_diagonal(vshi_sparse *m, uint32_t vertex, double value) {
    m->diagonal[m->order[vertex]] += value;
}

void vshi_sparse_pin(vshi_sparse *m, uint32_t vertex, vshi_complex value, vshi_complex *right) {
    const uint32_t pinned = m->order[vertex];
    for (uint32_t v = 0; v < m->count; ++v) { /* `work` holds the right side by rows for a while */
        m->work[m->order[v]] = right[v];
    }
    for (uint32_t i = m->begin[pinned]; i < m->begin[pinned + 1]; ++i) {
        vshi_complex *x = &m->work[m->column[i]];
        *x = vshi_complex_sub(*x, vshi_complex_times(vshi_conjugate(m->value[i]), value));
        m->value[i] = (vshi_complex){0.0, 0.0};
    }
    for (uint32_t row = pinned + 1; row < m->count; ++row) {
        for (uint32_t i = m->begin[row]; i < m->begin[row + 1]; ++i) {
            if (m->column[i] == pinned) {
                m->work[row] = vshi_complex_sub(m->work[row], vshi_complex_times(m->value[i], value));
                m->value[i] = (vshi_complex){0.0, 0.0};
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
        m->work[row] = (vshi_complex){0.0, 0.0};
        m->marks[row] = NONE;
        m->filled[row] = 0;
    }
    for (uint32_t row = 0; row < m->count; ++row) {
        const uint32_t top = row_pattern(m, row);
        for (uint32_t i = m->begin[row]; i < m->begin[row + 1]; ++i) {
            m->work[m->column[i]] = vshi_conjugate(m->value[i]);
        }
        double pivot = m->diagonal[row];
        for (uint32_t s = top; s < m->count; ++s) {
            const uint32_t c = m->stack[s], begin = m->factor_begin[c], end = begin + m->filled[c];
            const vshi_complex y = m->work[c];
            m->work[c] = (vshi_complex){0.0, 0.0};
            for (uint32_t i = begin; i < end; ++i) {
                vshi_complex *to = &m->work[m->factor_row[i]];
                const vshi_complex l = m->factor[i];
                to->re -= l.re * y.re - l.im * y.im;
                to->im -= l.re * y.im + l.im * y.re;
            }
            const vshi_complex l = {y.re / m->pivot[c], -y.im / m->pivot[c]};
            pivot -= y.re * l.re - y.im * l.im;
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

void vshi_sparse_solve(const vshi_sparse *m, vshi_complex *right) {
    vshi_complex *x = m->work;
    for (uint32_t v = 0; v < m->count; ++v) {
        x[m->order[v]] = right[v];
    }
    for (uint32_t c = 0; c < m->count; ++c) {
        const vshi_complex y = x[c];
        for (uint32_t i = m->factor_begin[c]; i < m->factor_begin[c + 1]; ++i) {
            vshi_complex *to = &x[m->factor_row[i]];
            const vshi_complex l = m->factor[i];
            to->re -= l.re * y.re - l.im * y.im;
            to->im -= l.re * y.im + l.im * y.re;
        }
    }
    for (uint32_t c = m->count; c-- > 0;) {
        vshi_complex y = vshi_complex_scaled(x[c], 1.0 / m->pivot[c]);
        for (uint32_t i = m->factor_begin[c]; i < m->factor_begin[c + 1]; ++i) {
            const vshi_complex l = m->factor[i], z = x[m->factor_row[i]];
            y.re -= l.re * z.re + l.im * z.im; /* conjugate of l */
            y.im -= l.re * z.im - l.im * z.re;
        }
        x[c] = y;
    }
    for (uint32_t v = 0; v < m->count; ++v) {
        right[v] = x[m->order[v]];
    }
}
