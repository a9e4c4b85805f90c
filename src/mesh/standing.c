/* What stands on something, or runs into it: open components whose holes other components close. A rivet on a
 * plate, a house without a floor that is sunk into the ground, a cabinet without a back against a wall. */
#include "mesh/standing.h"

#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>

/* What one that stands on something must enclose then: less than others, for nobody makes a vessel without
 * its bottom. A chimney, open above, and twice as high as it is wide, 0.92; a ring around a well 0.87. */
static const double STANDING_ENCLOSES = 0.9;
/* Of the samples of another component: as many lie within what holds it. */
static const double HELD_SHARE = 0.6;

enum { HELD_SAMPLES = 8 };

/* A component by where its box begins along x. */
typedef struct beginning {
    double x;
    uint32_t component;
} beginning;

typedef struct looking {
    const vshi_solidity *s;
    beginning *sorted;   /* [s->count] */
    vshi_vec (*caps)[3]; /* of a hole */
    vshi_vessel vessel;
} looking;

/* --- what is in it */

static bool is_within(const vshi_solidity *s, const vshi_component *c, vshi_vec point) {
    static const double PI = 3.14159265358979323846;
    const vshi_surface_part part = vshi_component_part(s, c);
    double times = vshi_winding(&part, point);
    for (size_t k = 0; k < c->open_edges; ++k) {
        times += vshi_solid_angle(c->cap[k], point) / (4.0 * PI);
    }
    return times > 0.5;
}

/* As nearly as the gap is wide is within: what is covered may stand on the same floor. */
static double room_around(const vshi_component *c) {
    return VSHI_STANDING_GAP * vshi_length(vshi_sub(c->high, c->low));
}

static bool box_holds(const vshi_component *outer, const vshi_component *inner) {
    const double by = room_around(outer);
    const vshi_vec more = {by, by, by}, low = vshi_sub(outer->low, more), high = vshi_add(outer->high, more);
    return inner->low.x >= low.x && inner->high.x <= high.x && inner->low.y >= low.y &&
           inner->high.y <= high.y && inner->low.z >= low.z && inner->high.z <= high.z;
}

static int compare_beginnings(const void *a, const void *b) {
    const beginning *x = a, *y = b;
    if (x->x != y->x) {
        return x->x < y->x ? -1 : 1;
    }
    return (x->component > y->component) - (x->component < y->component);
}

static void sort_beginnings(looking *l) {
    for (size_t i = 0; i < l->s->count; ++i) {
        l->sorted[i] = (beginning){l->s->components[i].low.x, (uint32_t)i};
    }
    qsort(l->sorted, l->s->count, sizeof *l->sorted, compare_beginnings);
}

/* The first component that begins at x or beyond. */
static size_t first_from(const looking *l, double x) {
    size_t begin = 0, end = l->s->count;
    while (begin < end) {
        const size_t middle = begin + (end - begin) / 2;
        if (l->sorted[middle].x < x) {
            begin = middle + 1;
        } else {
            end = middle;
        }
    }
    return begin;
}

/* Whether another component lies in it: furniture, which is there to be seen. */
static bool holds_something(const looking *l) {
    const vshi_solidity *s = l->s;
    const vshi_component *vessel = l->vessel.component;
    for (size_t i = first_from(l, vessel->low.x - room_around(vessel)); i < s->count; ++i) {
        const vshi_component *c = &s->components[l->sorted[i].component];
        if (c->low.x > vessel->high.x) {
            break;
        }
        if (c == vessel || !box_holds(vessel, c)) {
            continue;
        }
        const vshi_surface_part part = vshi_component_part(s, c);
        vshi_vec samples[HELD_SAMPLES];
        size_t within = 0;
        vshi_part_samples(&part, c->area, HELD_SAMPLES, samples);
        for (size_t k = 0; k < HELD_SAMPLES; ++k) {
            within += is_within(s, vessel, samples[k]);
        }
        if ((double)within >= HELD_SHARE * HELD_SAMPLES) {
            return true;
        }
    }
    return false;
}

/* --- all */

/* What the vessel's enclosing lacks by one hole. */
static double lacking_by(looking *l, uint32_t hole) {
    const vshi_component *c = l->vessel.component;
    if (c->holes == 1) {
        return 1.0 - c->enclosed;
    }
    size_t caps = 0;
    for (size_t i = 0; i < c->open_edges; ++i) {
        for (int corner = 0; l->vessel.hole_of[i] == hole && corner < 3; ++corner) {
            l->caps[caps][corner] = c->cap[i][corner];
        }
        caps += l->vessel.hole_of[i] == hole;
    }
    const vshi_surface_part part = vshi_component_part(l->s, c);
    return 1.0 - vshi_part_encloses(&part, c->area, (const vshi_vec(*)[3])l->caps, caps);
}

/* Whether a vessel is closed but for little. */
static bool stands(looking *l, const vshi_face_tree *tree, size_t vessel, double *enclosed) {
    if (!vshi_vessel_begin(&l->vessel, l->s, tree, (uint32_t)vessel) ||
        !vshi_vessel_find_closed(&l->vessel)) {
        return false;
    }
    vshi_vessel_find_covered(&l->vessel);
    *enclosed = 1.0;
    for (uint32_t k = 0; k < l->vessel.component->holes; ++k) {
        const double open = l->vessel.open[k];
        *enclosed -= open > 0.0 ? open * lacking_by(l, k) : 0.0;
    }
    return *enclosed >= STANDING_ENCLOSES && !holds_something(l);
}

vsh_result vshi_standing_find(vshi_solidity *s, vshi_job *job, vsh_error *error) {
    static const char *const name = "what stands on something";
    size_t most = 0;
    for (size_t i = 0; i < s->count; ++i) {
        const vshi_component *c = &s->components[i];
        most = c->vessel && c->open_edges > most ? c->open_edges : most;
    }
    if (most == 0 || s->count < 2) {
        return VSH_OK;
    }
    looking l = {.s = s};
    vshi_face *faces = NULL;
    vshi_face_tree *tree = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_faces_near_vessels(s, &faces, &tree, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&l.caps, most, sizeof *l.caps, name, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&l.sorted, s->count, sizeof *l.sorted, name, error));
    sort_beginnings(&l);
    for (size_t i = 0; i < s->count; ++i) {
        vshi_component *c = &s->components[i];
        double enclosed = 0.0;
        if (c->vessel && stands(&l, tree, i, &enclosed)) {
            c->stands = true;
            c->enclosed = enclosed;
        }
        if (vshi_job_cancelled(job)) {
            result = vshi_job_fail_cancelled(job, error);
            goto done;
        }
    }
    for (size_t i = 0; i < s->count; ++i) { /* at once: no order shows */
        if (s->components[i].stands) {
            s->components[i].kind = VSHI_KIND_SOLID;
        }
    }
done:
    free(l.sorted);
    free(l.caps);
    vshi_face_tree_free(tree);
    free(faces);
    return result;
}
