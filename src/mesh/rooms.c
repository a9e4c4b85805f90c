/* Which of the components that look inwards are rooms in solids. */
#include "base/memory.h"
#include "mesh/solidity_parts.h"

#include <math.h>
#include <stdlib.h>

enum { SAMPLES = 24, AROUND_SAMPLES = 8, MOST_ANGLES = 1 << 24 };

/* Shares of a room's samples. With the first in any solids it is a room. With the second in one solid it is
 * cut out of that one; a pillar that only reaches into the wall is left to stand in it. */
static const double ROOM_SHARE = 0.5, CUT_SHARE = 0.25;
/* A sample goes a whole number of times around what it does not lie on: nearer to 1/2 than this it does. */
static const double ON_SURFACE = 0.25;

typedef struct surrounding {
    vshi_vec samples[SAMPLES];
    bool inside[SAMPLES]; /* of any solid */
    size_t cuts;          /* found so far: of this room */
    bool coincides;       /* with a solid's own surface */
} surrounding;

static bool in_box(const vshi_component *c, vshi_vec p) {
    return p.x >= c->low.x && p.x <= c->high.x && p.y >= c->low.y && p.y <= c->high.y && p.z >= c->low.z &&
           p.z <= c->high.z;
}

static vsh_result add_cut(vshi_solidity *s, size_t room, size_t solid, vsh_error *error) {
    VSHI_TRY(
        vshi_make_room((void **)&s->cuts, s->cut_count, &s->cut_capacity, sizeof *s->cuts, "rooms", error));
    s->cuts[s->cut_count++] = (vshi_cut){(uint32_t)room, (uint32_t)solid};
    return VSH_OK;
}

/* Looks at how a room lies in one solid. */
static vsh_result look(vshi_solidity *s, size_t room, size_t solid, surrounding *around, vsh_error *error) {
    vshi_component *c = &s->components[solid];
    const vshi_surface_part part = vshi_component_part(s, c);
    size_t inside = 0, on = 0;
    for (size_t i = 0; i < SAMPLES; ++i) {
        if (!in_box(c, around->samples[i])) {
            continue;
        }
        const double times = fabs(vshi_winding(&part, around->samples[i]));
        if (fabs(times - floor(times) - 0.5) < ON_SURFACE) {
            ++on;
        } else if (times > 0.5) {
            ++inside;
            around->inside[i] = true;
        }
    }
    const bool found = s->wholes.meshes[c->whole].solidity == VSH_SOLIDITY_AUTO &&
                       s->wholes.meshes[s->components[room].whole].solidity == VSH_SOLIDITY_AUTO;
    if (found && (double)on > ROOM_SHARE * SAMPLES) { /* faces of both sides: air within, air outside */
        c->kind = VSHI_KIND_SHEET;
        around->coincides = true;
    }
    if ((double)inside < CUT_SHARE * SAMPLES) {
        return VSH_OK;
    }
    ++around->cuts;
    return add_cut(s, room, solid, error);
}

static vsh_result find_room(vshi_solidity *s, size_t room, vsh_error *error) {
    vshi_component *c = &s->components[room];
    const vshi_surface_part part = vshi_component_part(s, c);
    surrounding around = {.cuts = 0};
    vshi_part_samples(&part, c->area, SAMPLES, around.samples);
    for (size_t i = 0; i < s->count && !around.coincides; ++i) {
        const vshi_component *solid = &s->components[i];
        if (solid->kind == VSHI_KIND_SOLID && solid->low.x <= c->high.x && solid->high.x >= c->low.x &&
            solid->low.y <= c->high.y && solid->high.y >= c->low.y && solid->low.z <= c->high.z &&
            solid->high.z >= c->low.z) {
            VSHI_TRY(look(s, room, i, &around, error));
        }
    }
    size_t inside = 0;
    for (size_t i = 0; i < SAMPLES; ++i) {
        inside += around.inside[i];
    }
    if ((double)inside >= ROOM_SHARE * SAMPLES && !around.coincides && around.cuts > 0) {
        c->kind = VSHI_KIND_ROOM;
    } else {
        c->kind = around.coincides ? VSHI_KIND_SHEET : VSHI_KIND_WALL;
        s->cut_count -= around.cuts;
    }
    return VSH_OK;
}

/* A house whose skin has holes and an open room within: light goes from the one to the other, so neither is
 * closed over its holes. Returns whether there was one. */
static bool hollow(vshi_solidity *s) {
    bool found = false;
    for (size_t i = 0; i < s->cut_count; ++i) {
        vshi_component *solid = &s->components[s->cuts[i].solid];
        if (solid->open_edges > 0 && s->components[s->cuts[i].room].open_edges > 0) {
            solid->kind = VSHI_KIND_WALL;
            found = true;
        }
    }
    return found;
}

/* A dome has at least this share of the samples of all other components within. */
static const double AROUND_SHARE = 0.95;

/* Counts the samples of a component that lie in a solid. */
static size_t count_within(const vshi_solidity *s, const vshi_component *solid, const vshi_component *c) {
    const vshi_surface_part around = vshi_component_part(s, solid), part = vshi_component_part(s, c);
    vshi_vec samples[AROUND_SAMPLES];
    size_t within = 0;
    vshi_part_samples(&part, c->area, AROUND_SAMPLES, samples);
    for (size_t i = 0; i < AROUND_SAMPLES; ++i) {
        within += in_box(solid, samples[i]) && vshi_winding(&around, samples[i]) > 0.5;
    }
    return within;
}

/* The content of a dome is smaller than this share of it, or has more than solids. Eyes in a head and an
 * engine in its hood are solids alone, and of about the size around them. */
static const double DOME_SHARE = 0.5;

static double longest(vshi_vec size) {
    return fmax(size.x, fmax(size.y, size.z));
}

/* Whether what lies within `dome` is what a sky dome has within. */
static bool fits_a_dome(const vshi_solidity *s, const vshi_component *dome) {
    vshi_vec low = {INFINITY, INFINITY, INFINITY}, high = {-INFINITY, -INFINITY, -INFINITY};
    bool solids = true;
    for (size_t i = 0; i < s->count; ++i) {
        const vshi_component *c = &s->components[i];
        if (c != dome) {
            solids = solids && c->kind == VSHI_KIND_SOLID;
            low = (vshi_vec){fmin(low.x, c->low.x), fmin(low.y, c->low.y), fmin(low.z, c->low.z)};
            high = (vshi_vec){fmax(high.x, c->high.x), fmax(high.y, c->high.y), fmax(high.z, c->high.z)};
        }
    }
    return !solids || longest(vshi_sub(high, low)) < DOME_SHARE * longest(vshi_sub(dome->high, dome->low));
}

/* Finds a sky dome whose faces look outwards: a closed solid around everything else, without a room. As a
 * solid it would bury all that it is to surround. */
static void find_dome(vshi_solidity *s) {
    vshi_component *dome = NULL;
    double largest = 0.0;
    for (size_t i = 0; i < s->count; ++i) {
        const vshi_vec size = vshi_sub(s->components[i].high, s->components[i].low);
        const double across = vshi_length(size);
        if (across > largest) {
            largest = across;
            dome = &s->components[i];
        }
    }
    if (dome == NULL || dome->kind != VSHI_KIND_SOLID || dome->open_edges > 0 || s->cut_count > 0 ||
        s->wholes.meshes[dome->whole].solidity != VSH_SOLIDITY_AUTO || s->count < 2 ||
        !fits_a_dome(s, dome)) {
        return;
    }
    const size_t most = MOST_ANGLES / (AROUND_SAMPLES * (dome->triangles + 1)) + 16;
    const size_t step = (s->count + most - 1) / most;
    size_t within = 0, looked_at = 0;
    for (size_t i = 0; i < s->count; i += step) {
        if (&s->components[i] == dome) {
            continue;
        }
        within += count_within(s, dome, &s->components[i]);
        looked_at += AROUND_SAMPLES;
        if ((double)(looked_at - within) > (1.0 - AROUND_SHARE) * (double)(AROUND_SAMPLES * s->count)) {
            return;
        }
    }
    if (looked_at > 0 && (double)within >= AROUND_SHARE * (double)looked_at) {
        dome->kind = VSHI_KIND_SHEET;
        dome->around_all = true;
    }
}

static int compare_cuts(const void *a, const void *b) {
    const vshi_cut *x = a, *y = b;
    if (x->solid != y->solid) {
        return x->solid < y->solid ? -1 : 1;
    }
    return (x->room > y->room) - (x->room < y->room);
}

vsh_result vshi_rooms_find(vshi_solidity *s, vsh_error *error) {
    do {
        s->cut_count = 0;
        for (size_t i = 0; i < s->count; ++i) {
            const vshi_component *c = &s->components[i];
            if (c->inward && c->kind != VSHI_KIND_SHEET) {
                VSHI_TRY(find_room(s, i, error));
            }
        }
    } while (hollow(s));
    find_dome(s);
    if (s->cut_count > 1) {
        qsort(s->cuts, s->cut_count, sizeof *s->cuts, compare_cuts);
    }
    return VSH_OK;
}
