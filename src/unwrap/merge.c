#include "unwrap/shapes.h"

#include "base/memory.h"

#include <stdlib.h>

static const char what[] = "joining charts";

/* L2 stretch of a joined chart at most: the mean over all charts is to be within 1.05. */
static const double MOST_STRETCH = 1.045;

static const double LEAST_SHARED = 0.12; /* of the border of the chart that has less of it */
static const double HARD = 0.3;          /* what a length of seam counts as shared border */

/* Square of a joined chart's perimeter over its area: 12.6 for a disc, 16 for a square, 25 for a rectangle of
 * 4 to
 * 1. Charts beyond that are joined only where they become no worse. */
static const double ROUND = 28.0, NO_WORSE = 1.1;

vsh_result vshi_merging_begin(const vshi_cut_mesh *s, vshi_patches *patches, double max_stretch,
                              double max_area, vshi_merging *m, vsh_error *error) {
    const size_t count = patches->count;
    *m = (vshi_merging){.surface = s,
                        .patches = patches,
                        .max_area = max_area,
                        .max_stretch = fmin(max_stretch, MOST_STRETCH)};
    const vshi_array arrays[] = {VSHI_ARRAY(m->owner, s->count), VSHI_ARRAY(m->perimeter, count),
                                 VSHI_ARRAY(m->version, count), VSHI_ARRAY(m->trials, count / 2 + 1)};
    VSHI_TRY(VSHI_ALLOCATE_ALL(arrays, what, error));
    memset(m->owner, 0xff, s->count * sizeof *m->owner);
    for (uint32_t c = 0; c < count; ++c) {
        const vshi_patch *p = &patches->list[c];
        m->version[c] = m->versions++;
        for (uint32_t i = 0; i < p->count; ++i) {
            m->owner[p->triangles[i]] = c;
        }
        for (uint32_t side = 0; side < 3 * p->count; ++side) {
            if (p->beyond[side] == VSHI_NONE) {
                m->perimeter[c] += vshi_side_length(s, 3 * p->triangles[side / 3] + side % 3);
            }
        }
    }
    return VSH_OK;
}

static void drop_trials(vshi_merging *m) {
    for (uint32_t i = 0; i < m->trial_count; ++i) {
        vshi_patch_free(&m->trials[i].patch);
    }
    m->trial_count = 0;
}

void vshi_merging_free(vshi_merging *m) {
    if (m->trials != NULL) {
        drop_trials(m);
    }
    free(m->failed);
    free(m->trials);
    free(m->version);
    free(m->perimeter);
    free(m->owner);
    *m = (vshi_merging){0};
}

/* A piece of border between two charts, a < b. */
typedef struct border {
    uint32_t a, b, side;
    double length, shared; /* shared: seams count less */
} border;

static int compare_borders(const void *a, const void *b) {
    const border *x = a, *y = b;
    if (x->a != y->a) {
        return x->a < y->a ? -1 : 1;
    }
    if (x->b != y->b) {
        return x->b < y->b ? -1 : 1;
    }
    return (x->side > y->side) - (x->side < y->side);
}

static int compare_shares(const void *a, const void *b) {
    const border *x = a, *y = b;
    if (x->shared != y->shared) {
        return x->shared > y->shared ? -1 : 1;
    }
    return compare_borders(a, b);
}

static int compare_keys(const void *a, const void *b) {
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

static uint64_t key_of(const vshi_merging *m, uint32_t a, uint32_t b) {
    const uint32_t x = m->version[a], y = m->version[b];
    return x < y ? (uint64_t)x << 32 | y : (uint64_t)y << 32 | x;
}

static bool has_failed(const vshi_merging *m, uint32_t a, uint32_t b) {
    const uint64_t key = key_of(m, a, b);
    return m->failed_count > 0 && bsearch(&key, m->failed, m->failed_count, sizeof key, compare_keys) != NULL;
}

/* Whether two charts would make a round one. */
static bool promising(const vshi_merging *m, const border *pair) {
    const double pa = m->perimeter[pair->a], pb = m->perimeter[pair->b], aa = m->patches->list[pair->a].area,
                 ab = m->patches->list[pair->b].area, joined = pa + pb - 2.0 * pair->length;
    const double roundness = joined * joined / (aa + ab), before = (pa * pa + pb * pb) / (aa + ab);
    return aa + ab < m->max_area && pair->shared > LEAST_SHARED &&
           (roundness < ROUND || roundness < NO_WORSE * before) && !has_failed(m, pair->a, pair->b);
}

/* Borders by pairs of charts. */
static vsh_result find_pairs(const vshi_merging *m, border **pairs, size_t *count, vsh_error *error) {
    const vshi_cut_mesh *s = m->surface;
    size_t sides = 0, room = 0;
    for (uint32_t side = 0; side < 3 * (uint32_t)s->count; ++side) {
        const uint32_t other = s->partner[side], a = m->owner[side / 3],
                       b = other != VSHI_NONE ? m->owner[other / 3] : a;
        if (a == VSHI_NONE || b == VSHI_NONE || a >= b) {
            continue;
        }
        const double length = vshi_side_length(s, side);
        VSHI_TRY(vshi_make_room((void **)pairs, sides, &room, sizeof **pairs, what, error));
        (*pairs)[sides++] = (border){a, b, side, length, s->soft[side] ? length : HARD * length};
    }
    if (sides > 0) {
        qsort(*pairs, sides, sizeof **pairs, compare_borders);
    }
    *count = 0;
    for (size_t i = 0; i < sides; ++i) {
        border *last = *count > 0 ? &(*pairs)[*count - 1] : NULL;
        if (last != NULL && last->a == (*pairs)[i].a && last->b == (*pairs)[i].b) {
            last->length += (*pairs)[i].length;
            last->shared += (*pairs)[i].shared;
        } else {
            (*pairs)[(*count)++] = (*pairs)[i];
        }
    }
    return VSH_OK;
}

vsh_result vshi_merging_plan(vshi_merging *m, vsh_error *error) {
    border *pairs = NULL;
    uint8_t *taken = NULL;
    size_t count = 0, kept = 0;
    vsh_result result;
    drop_trials(m);
    VSHI_TRY_DONE(find_pairs(m, &pairs, &count, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&taken, m->patches->count, 1, what, error));
    for (size_t i = 0; i < count; ++i) {
        border pair = pairs[i];
        const double pa = m->perimeter[pair.a], pb = m->perimeter[pair.b];
        pair.shared /= pa < pb ? pa : pb;
        if (promising(m, &pair)) {
            pairs[kept++] = pair;
        }
    }
    if (kept > 0) {
        qsort(pairs, kept, sizeof *pairs, compare_shares);
    }
    for (size_t i = 0; i < kept; ++i) {
        const border *pair = &pairs[i];
        if (!taken[pair->a] && !taken[pair->b]) {
            taken[pair->a] = taken[pair->b] = 1;
            m->trials[m->trial_count++] =
                (vshi_trial){.merging = m,
                             .a = pair->a,
                             .b = pair->b,
                             .perimeter = m->perimeter[pair->a] + m->perimeter[pair->b] - 2.0 * pair->length};
        }
    }
done:
    free(taken);
    free(pairs);
    return result;
}

vsh_result vshi_merging_try(vshi_trial *trial, vsh_error *error) {
    const vshi_merging *m = trial->merging;
    const vshi_patch *a = &m->patches->list[trial->a], *b = &m->patches->list[trial->b];
    uint32_t *triangles = NULL;
    VSHI_TRY(vshi_allocate((void **)&triangles, (size_t)a->count + b->count, sizeof *triangles, what, error));
    for (uint32_t i = 0, k = 0; i + k < a->count + b->count;) {
        if (k == b->count || (i < a->count && a->triangles[i] < b->triangles[k])) {
            triangles[i + k] = a->triangles[i];
            ++i;
        } else {
            triangles[i + k] = b->triangles[k];
            ++k;
        }
    }
    VSHI_TRY(vshi_patch_make(m->surface, triangles, a->count + b->count, &trial->patch, error));
    VSHI_TRY(vshi_flatten(&trial->patch, m->max_stretch, &trial->good, error));
    if (!trial->good) {
        vshi_patch_free(&trial->patch);
    }
    return VSH_OK;
}

/* Closes the gaps that joined charts have left. */
static void close_up(vshi_merging *m) {
    uint32_t kept = 0;
    for (uint32_t c = 0; c < m->patches->count; ++c) {
        if (m->patches->list[c].count == 0) {
            continue;
        }
        if (kept != c) {
            m->patches->list[kept] = m->patches->list[c];
            m->perimeter[kept] = m->perimeter[c];
            m->version[kept] = m->version[c];
            for (uint32_t i = 0; i < m->patches->list[kept].count; ++i) {
                m->owner[m->patches->list[kept].triangles[i]] = kept;
            }
        }
        ++kept;
    }
    m->patches->count = kept;
}

vsh_result vshi_merging_apply(vshi_merging *m, vsh_error *error) {
    for (uint32_t i = 0; i < m->trial_count; ++i) {
        vshi_trial *trial = &m->trials[i];
        if (!trial->good) {
            VSHI_TRY(vshi_make_room((void **)&m->failed, m->failed_count, &m->failed_capacity,
                                    sizeof *m->failed, what, error));
            m->failed[m->failed_count++] = key_of(m, trial->a, trial->b);
            continue;
        }
        vshi_patch_free(&m->patches->list[trial->a]);
        vshi_patch_free(&m->patches->list[trial->b]);
        vshi_patch *joined = &m->patches->list[trial->a];
        *joined = trial->patch;
        trial->patch = (vshi_patch){0};
        m->perimeter[trial->a] = trial->perimeter;
        m->version[trial->a] = m->versions++;
        for (uint32_t k = 0; k < joined->count; ++k) {
            m->owner[joined->triangles[k]] = trial->a;
        }
    }
    if (m->failed_count > 0) {
        qsort(m->failed, m->failed_count, sizeof *m->failed, compare_keys);
    }
    close_up(m);
    return VSH_OK;
}
