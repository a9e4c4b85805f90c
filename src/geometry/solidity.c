#include "geometry/solidity.h"

#include "base/elementary.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "geometry/edges.h"

#include <stdlib.h>
#include <string.h>

/* A list of a mesh's triangles. Some are turned over. */
typedef struct surface_part {
    const vsh_mesh *mesh;
    const uint32_t *list; /* [count] */
    size_t count;
    const uint8_t *turned; /* of the mesh's triangles */
} surface_part;

/* `turned` of the triangles of the component's whole. */
static inline uint8_t *turned_of(const vshi_solidity *s, const vshi_component *component) {
    return s->turned + s->first_side[s->wholes.first[component->whole]];
}

/* --- solids, walls and sheets, by one component alone */

/* An open surface that encloses this share counts as closed. Measured solids: a ball with small holes has
 * 0.98 and more, a head open at its neck 0.95, a tree's trunk 0.96. Measured sheets: a cup has 0.91, a box
 * without its lid 0.90, half a sphere 0.82, a short tube 0.79, a tent 0.64, a curtain 0.60. A cup that is
 * filled by mistake buries its content, so the limit is above it. */
static const double SOLID_ENCLOSES = 0.945;
/* Least share that a surface which looks inwards must enclose. Its faces only get a thin wall, so a room may
 * lack a whole side. */
static const double WALL_ENCLOSES = 0.86;
/* Least share of the area that must look inwards. If faces disagree more, a closed component is solid. */
static const double INWARD_SHARE = 2.0 / 3.0;
/* Least volume, as a share of the area to the power of 1.5. Rounding makes less out of no volume; a sphere
 * has 0.094. */
static const double LEAST_VOLUME = 1e-6;
/* Share of the area that has a duplicate facing the other way: such faces are double-sided sheets. */
static const double DOUBLED_SHARE = 0.5;

/* --- generalized winding numbers (A. Jacobson, L. Kavan, O. Sorkine-Hornung, "Robust inside-outside
 * segmentation using generalized winding numbers", 2013): the sum of the triangles' solid angles over the
 * whole sphere's */

static const double PI = 3.14159265358979323846;

/* Sample points of part_encloses(). It uses fewer for many open edges, to limit the sum of solid angles. */
enum { MOST_SAMPLES = 128, FEWEST_SAMPLES = 16, MOST_ANGLES = 1 << 21 };

/* World corners of a triangle that a part lists. */
static void part_corners(const surface_part *part, size_t at, vshi_vec corner[3]) {
    const uint32_t i = part->list[at];
    vshi_mesh_triangle(part->mesh, i, corner);
    if (part->turned[i]) {
        const vshi_vec swapped = corner[1];
        corner[1] = corner[2];
        corner[2] = swapped;
    }
}

/* Solid angle of a triangle seen from a point, -2π … 2π: positive from behind it. A. van Oosterom and J.
 * Strackee, "The solid angle of a plane triangle", 1983. */
static double solid_angle(const vshi_vec corner[3], vshi_vec point) {
    const vshi_vec a = vshi_sub(corner[0], point), b = vshi_sub(corner[1], point),
                   c = vshi_sub(corner[2], point);
    const double la = vshi_length(a), lb = vshi_length(b), lc = vshi_length(c);
    const double over = vshi_dot(a, vshi_cross(b, c));
    if (over == 0.0) { /* the point is in the triangle's plane */
        return 0.0;
    }
    return 2.0 *
           vshi_atan2(over, la * lb * lc + vshi_dot(a, b) * lc + vshi_dot(b, c) * la + vshi_dot(c, a) * lb);
}

/* How often a part winds around a point: 1 inside of a closed surface, 0 outside, 1/2 on it, and between
 * these for an open one. */
static double find_winding(const surface_part *part, vshi_vec point) {
    double sum = 0.0;
    for (size_t at = 0; at < part->count; ++at) {
        vshi_vec corner[3];
        part_corners(part, at, corner);
        sum += solid_angle(corner, point);
    }
    return sum / (4.0 * PI);
}

/* Uses the fractions of the additive sequence of the plastic number (M. Roberts, 2018). */
vshi_vec vshi_point_in(const vshi_vec corner[3], size_t number) {
    const double u = 0.5 + 0.7548776662466927 * (double)number, v = 0.5 + 0.5698402909980532 * (double)number;
    return vshi_triangle_point(corner, u - floor(u), v - floor(v));
}

/* Spreads `count` points over a part by area. */
static void spread_samples(const surface_part *part, double area, size_t count, vshi_vec *samples) {
    double reached = 0.0;
    size_t next = 0;
    vshi_vec corner[3] = {{0.0, 0.0, 0.0}};
    for (size_t at = 0; at < part->count && next < count; ++at) {
        part_corners(part, at, corner);
        reached += vshi_triangle_area(corner);
        while (next < count && reached >= area * ((double)next + 0.5) / (double)count) {
            samples[next] = vshi_point_in(corner, next);
            ++next;
        }
    }
    for (; next < count; ++next) { /* rounding */
        samples[next] = vshi_point_in(corner, next);
    }
}

/* The share of one of its sides that a part encloses: 1 if it is closed, 1/2 for a plane. `caps` are
 * triangles over its holes. A surface with its caps winds around a point a whole number of times, so the
 * caps' winding alone tells what the surface lacks. */
static double part_encloses(const surface_part *part, double area, const vshi_vec (*caps)[3],
                            size_t cap_count) {
    if (cap_count == 0) {
        return 1.0;
    }
    vshi_vec samples[MOST_SAMPLES];
    size_t count = MOST_ANGLES / cap_count;
    count = count < FEWEST_SAMPLES ? FEWEST_SAMPLES : count > MOST_SAMPLES ? MOST_SAMPLES : count;
    spread_samples(part, area, count, samples);
    double lacking = 0.0;
    for (size_t i = 0; i < count; ++i) {
        double sum = 0.0;
        for (size_t k = 0; k < cap_count; ++k) {
            sum += solid_angle(caps[k], samples[i]);
        }
        sum /= 4.0 * PI;
        lacking += fabs(sum - floor(sum + 0.5));
    }
    return 1.0 - lacking / (double)count;
}

/* --- measures */

/* Areas of a component that decide its kind, world units². */
typedef struct measure {
    double turned_area, doubled_area;
} measure;

static const vshi_vec LOWEST = {-INFINITY, -INFINITY, -INFINITY}, HIGHEST = {INFINITY, INFINITY, INFINITY};

static void grow_box(vshi_vec *low, vshi_vec *high, vshi_vec p) {
    *low = (vshi_vec){fmin(low->x, p.x), fmin(low->y, p.y), fmin(low->z, p.z)};
    *high = (vshi_vec){fmax(high->x, p.x), fmax(high->y, p.y), fmax(high->z, p.z)};
}

/* Six times the volume of the tetrahedron over a triangle from `origin`. */
static double volume_from(const vshi_vec corner[3], vshi_vec origin) {
    return vshi_dot(vshi_sub(corner[0], origin),
                    vshi_cross(vshi_sub(corner[1], origin), vshi_sub(corner[2], origin)));
}

/* A component as a part of its whole. */
static surface_part part_of(const vshi_solidity *s, const vshi_component *c) {
    return (surface_part){&s->wholes.meshes[c->whole], c->list, c->triangles, turned_of(s, c)};
}

static measure measure_component(const vshi_solidity *s, vshi_component *c) {
    const vshi_components *found = &s->found[c->whole];
    const surface_part part = part_of(s, c);
    measure m = {0.0, 0.0};
    double volume = 0.0;
    vshi_vec origin = {0.0, 0.0, 0.0};
    c->low = HIGHEST;
    c->high = LOWEST;
    for (size_t at = 0; at < c->triangles; ++at) {
        const uint32_t i = c->list[at];
        vshi_vec corner[3];
        part_corners(&part, at, corner);
        origin = at == 0 ? corner[0] : origin;
        const double area = vshi_triangle_area(corner);
        c->area += area;
        m.turned_area += part.turned[i] ? area : 0.0;
        m.doubled_area += found->doubled[i] ? area : 0.0;
        volume += volume_from(corner, origin);
        for (int k = 0; k < 3; ++k) {
            grow_box(&c->low, &c->high, corner[k]);
        }
    }
    for (size_t k = 0; k < c->open_edges; ++k) {
        volume += volume_from(c->cap[k], origin);
    }
    c->volume = volume / 6.0;
    return m;
}

/* Turns a component and its caps over. */
static void turn_component(vshi_solidity *s, vshi_component *c) {
    uint8_t *turned = turned_of(s, c);
    for (size_t at = 0; at < c->triangles; ++at) {
        turned[c->list[at]] ^= 1;
    }
    for (size_t k = 0; k < c->open_edges; ++k) {
        const vshi_vec swapped = c->cap[k][0];
        c->cap[k][0] = c->cap[k][1];
        c->cap[k][1] = swapped;
    }
}

/* --- holes: triangles to its middle close each connected group of open edges */

typedef struct hole {
    vshi_vec sum; /* the middles of its edges, by their lengths */
    double length;
} hole;

typedef struct closing {
    const vsh_mesh *mesh;
    uint32_t *parent; /* [vertex_count] */
    uint32_t *number; /* [vertex_count]: of a root's hole */
    hole *holes;      /* [open edges] */
} closing;

static size_t close_holes(closing *k, const vshi_rim *rims, size_t count, vshi_vec (*caps)[3]) {
    size_t holes = 0;
    for (size_t i = 0; i < count; ++i) {
        k->parent[rims[i].a] = rims[i].a;
        k->parent[rims[i].b] = rims[i].b;
        k->number[rims[i].a] = k->number[rims[i].b] = UINT32_MAX;
    }
    for (size_t i = 0; i < count; ++i) {
        vshi_set_join(k->parent, rims[i].a, rims[i].b);
    }
    for (size_t i = 0; i < count; ++i) {
        uint32_t *number = &k->number[vshi_set_of(k->parent, rims[i].a)];
        if (*number == UINT32_MAX) {
            *number = (uint32_t)holes;
            k->holes[holes++] = (hole){{0.0, 0.0, 0.0}, 0.0};
        }
        hole *h = &k->holes[*number];
        const vshi_vec a = vshi_mesh_place(k->mesh, rims[i].a), b = vshi_mesh_place(k->mesh, rims[i].b);
        const double length = vshi_length(vshi_sub(a, b));
        h->sum = vshi_add(h->sum, vshi_scale(vshi_add(a, b), 0.5 * length));
        h->length += length;
    }
    for (size_t i = 0; i < count; ++i) {
        const hole *h = &k->holes[k->number[vshi_set_of(k->parent, rims[i].a)]];
        caps[i][0] = vshi_mesh_place(k->mesh, rims[i].b);
        caps[i][1] = vshi_mesh_place(k->mesh, rims[i].a);
        caps[i][2] = h->length > 0.0 ? vshi_scale(h->sum, 1.0 / h->length) : caps[i][0];
    }
    return holes;
}

/* --- kinds */

static void decide(vshi_solidity *s, vshi_component *c, const measure *m) {
    const int32_t asked = s->wholes.meshes[c->whole].solidity;
    const vshi_components *found = &s->found[c->whole];
    const bool twisted = found->twisted[(size_t)(c - s->components) - s->first[c->whole]] != 0;
    double turned_area = m->turned_area;
    if (turned_area > 0.5 * c->area) { /* most faces are right */
        turn_component(s, c);
        turned_area = c->area - turned_area;
        c->volume = -c->volume;
    }
    const double least = LEAST_VOLUME * c->area * sqrt(c->area);
    c->kind = VSHI_KIND_SHEET;
    c->enclosed = 0.5;
    if (!(fabs(c->volume) > least) || (twisted && c->open_edges > 0)) {
        c->volume = 0.0;
        return;
    }
    const bool agreed = turned_area <= (1.0 - INWARD_SHARE) * c->area;
    const bool inward = asked == VSH_SOLIDITY_INWARD ||
                        (asked != VSH_SOLIDITY_SOLID && c->volume < 0.0 && agreed && !twisted);
    if (inward != (c->volume < 0.0) && !twisted) {
        turn_component(s, c);
    }
    c->volume = fabs(c->volume);
    const surface_part part = part_of(s, c);
    c->enclosed = part_encloses(&part, c->area, c->cap, c->open_edges);
    const bool single = m->doubled_area < DOUBLED_SHARE * c->area;
    const bool encloses = c->enclosed >= (inward ? WALL_ENCLOSES : SOLID_ENCLOSES) && single;
    if (asked != VSH_SOLIDITY_SHELL && (encloses || asked != VSH_SOLIDITY_AUTO)) {
        c->kind = inward ? VSHI_KIND_WALL : VSHI_KIND_SOLID;
        c->inward = inward;
    }
    c->vessel = c->kind == VSHI_KIND_SHEET && c->open_edges > 0 && asked == VSH_SOLIDITY_AUTO && !inward &&
                agreed && single;
}

/* A vshi_element_fn over wholes: measures the components, closes their holes, and decides their kinds. */
static vsh_result measure_whole(void *user, size_t whole, vsh_error *error) {
    vshi_solidity *s = user;
    const vshi_components *found = &s->found[whole];
    closing k = {.mesh = &s->wholes.meshes[whole]};
    const size_t vertices = found->rim_count > 0 ? k.mesh->vertex_count : 0;
    const vshi_array arrays[] = {VSHI_ARRAY(k.parent, vertices), VSHI_ARRAY(k.number, vertices),
                                 VSHI_ARRAY(k.holes, found->rim_count)};
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, "holes", error));
    for (size_t i = 0, rim = 0; i < found->count; ++i) {
        vshi_component *c = &s->components[s->first[whole] + i];
        *c = (vshi_component){.whole = (uint32_t)whole,
                              .triangles = found->begin[i + 1] - found->begin[i],
                              .list = found->list + found->begin[i]};
        while (rim + c->open_edges < found->rim_count && found->rims[rim + c->open_edges].component == i) {
            ++c->open_edges;
        }
        if (c->open_edges > 0) {
            c->cap = s->caps + s->first_cap[whole] + rim;
            c->holes = close_holes(&k, found->rims + rim, c->open_edges, c->cap);
            rim += c->open_edges;
        }
        const measure m = measure_component(s, c);
        decide(s, c, &m);
    }
    free(k.parent);
    return VSH_OK;
}

/* --- rooms: components that look inwards and lie in solids */

enum { SAMPLES = 24, AROUND_SAMPLES = 8, DOME_ANGLES = 1 << 24 };

/* Shares of the samples of a component that looks inwards. It is a room if solids contain ROOM_SHARE of them.
 * It is cut out of each solid that contains CUT_SHARE; a pillar that only reaches into the wall contains
 * fewer. */
static const double ROOM_SHARE = 0.5, CUT_SHARE = 0.25;
/* A sample whose winding number is nearer to 1/2 than this lies on the surface. */
static const double ON_SURFACE = 0.25;

/* A room's samples, and what is known of the solids around it. */
typedef struct surrounding {
    vshi_vec samples[SAMPLES];
    bool inside[SAMPLES]; /* of any solid */
    size_t cuts;          /* of this room, so far */
    bool coincides;       /* with a solid's own surface */
} surrounding;

static bool in_box(const vshi_component *c, vshi_vec p) {
    return p.x >= c->low.x && p.x <= c->high.x && p.y >= c->low.y && p.y <= c->high.y && p.z >= c->low.z &&
           p.z <= c->high.z;
}

/* Compares a room with one solid. */
static vsh_result compare_room(vshi_solidity *s, size_t room, size_t solid, surrounding *around,
                               vsh_error *error) {
    vshi_component *c = &s->components[solid];
    const surface_part part = part_of(s, c);
    size_t inside = 0, on = 0;
    for (size_t i = 0; i < SAMPLES; ++i) {
        if (!in_box(c, around->samples[i])) {
            continue;
        }
        const double times = fabs(find_winding(&part, around->samples[i]));
        if (fabs(times - floor(times) - 0.5) < ON_SURFACE) {
            ++on;
        } else if (times > 0.5) {
            ++inside;
            around->inside[i] = true;
        }
    }
    const bool found = s->wholes.meshes[c->whole].solidity == VSH_SOLIDITY_AUTO &&
                       s->wholes.meshes[s->components[room].whole].solidity == VSH_SOLIDITY_AUTO;
    if (found && (double)on > ROOM_SHARE * SAMPLES) { /* doubled faces: air within, air outside */
        c->kind = VSHI_KIND_SHEET;
        around->coincides = true;
    }
    if ((double)inside < CUT_SHARE * SAMPLES) {
        return VSH_OK;
    }
    VSHI_TRY(
        vshi_make_room((void **)&s->cuts, s->cut_count, &s->cut_capacity, sizeof *s->cuts, "rooms", error));
    s->cuts[s->cut_count++] = (vshi_cut){(uint32_t)room, (uint32_t)solid};
    ++around->cuts;
    return VSH_OK;
}

static vsh_result find_room(vshi_solidity *s, size_t room, vsh_error *error) {
    vshi_component *c = &s->components[room];
    const surface_part part = part_of(s, c);
    surrounding around = {.cuts = 0};
    spread_samples(&part, c->area, SAMPLES, around.samples);
    for (size_t i = 0; i < s->count && !around.coincides; ++i) {
        const vshi_component *solid = &s->components[i];
        if (solid->kind == VSHI_KIND_SOLID && solid->low.x <= c->high.x && solid->high.x >= c->low.x &&
            solid->low.y <= c->high.y && solid->high.y >= c->low.y && solid->low.z <= c->high.z &&
            solid->high.z >= c->low.z) {
            VSHI_TRY(compare_room(s, room, i, &around, error));
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

/* Makes walls of solids that have holes and an open room: light passes from one to the other, so neither is
 * closed over its holes. Returns whether there was one. */
static bool open_houses(vshi_solidity *s) {
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

/* Least share of the samples of all other components that lie within a dome. */
static const double AROUND_SHARE = 0.95;

/* Counts the samples of a component that lie in a solid. */
static size_t count_within(const vshi_solidity *s, const vshi_component *solid, const vshi_component *c) {
    const surface_part around = part_of(s, solid), part = part_of(s, c);
    vshi_vec samples[AROUND_SAMPLES];
    size_t within = 0;
    spread_samples(&part, c->area, AROUND_SAMPLES, samples);
    for (size_t i = 0; i < AROUND_SAMPLES; ++i) {
        within += in_box(solid, samples[i]) && find_winding(&around, samples[i]) > 0.5;
    }
    return within;
}

/* The content of a dome is shorter than this share of the dome's longest side, or not all solid. Eyes in a
 * head and an engine in its hood are solids, and about as large. */
static const double DOME_SHARE = 0.5;

static double longest(vshi_vec size) {
    return fmax(size.x, fmax(size.y, size.z));
}

/* Whether all other components may be the content of a sky dome. */
static bool fits_a_dome(const vshi_solidity *s, const vshi_component *dome) {
    vshi_vec low = HIGHEST, high = LOWEST;
    bool solids = true;
    for (size_t i = 0; i < s->count; ++i) {
        const vshi_component *c = &s->components[i];
        if (c != dome) {
            solids = solids && c->kind == VSHI_KIND_SOLID;
            grow_box(&low, &high, c->low);
            grow_box(&low, &high, c->high);
        }
    }
    return !solids || longest(vshi_sub(high, low)) < DOME_SHARE * longest(vshi_sub(dome->high, dome->low));
}

/* Finds a sky dome whose faces look outwards: a closed solid around everything else, without a room. As a
 * solid it would bury its content. */
static void find_dome(vshi_solidity *s) {
    vshi_component *dome = NULL;
    double largest = 0.0;
    for (size_t i = 0; i < s->count; ++i) {
        const double across = vshi_length(vshi_sub(s->components[i].high, s->components[i].low));
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
    const size_t most = DOME_ANGLES / (AROUND_SAMPLES * (dome->triangles + 1)) + 16;
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

/* Separates rooms from walls by the solids around them, and finds the solids that rooms are cut out of. */
static vsh_result find_rooms(vshi_solidity *s, vsh_error *error) {
    do {
        s->cut_count = 0;
        for (size_t i = 0; i < s->count; ++i) {
            const vshi_component *c = &s->components[i];
            if (c->inward && c->kind != VSHI_KIND_SHEET) {
                VSHI_TRY(find_room(s, i, error));
            }
        }
    } while (open_houses(s));
    find_dome(s);
    if (s->cut_count > 1) {
        qsort(s->cuts, s->cut_count, sizeof *s->cuts, compare_cuts);
    }
    return VSH_OK;
}

/* Peak memory for a triangle and for a vertex. */
static const double BYTES_PER_TRIANGLE = 120.0, BYTES_PER_VERTEX = 24.0;
/* Terrains need less, because their edges are known. */
static const double TERRAIN_BYTES_PER_TRIANGLE = 9.0, TERRAIN_BYTES_PER_VERTEX = 4.0;

/* --- objects joined from their parts */

static bool one_object(const vsh_mesh *a, const vsh_mesh *b) {
    return a->object != 0 && a->object == b->object && a->solidity == b->solidity &&
           vshi_mesh_same_transform(a->transform, b->transform);
}

static vsh_result join_parts(const vsh_mesh *parts, size_t count, vshi_wholes *w, vsh_error *error) {
    vsh_mesh *whole = &w->meshes[w->count];
    *whole = parts[0];
    for (size_t i = 1; i < count; ++i) {
        whole->vertex_count += parts[i].vertex_count;
        whole->triangle_count += parts[i].triangle_count;
    }
    if (count == 1) {
        return VSH_OK;
    }
    whole->normals = whole->uvs = NULL;
    VSHI_TRY(vshi_allocate((void **)&w->positions[w->count], whole->vertex_count, 3 * sizeof(float),
                           "parts of an object", error));
    VSHI_TRY(vshi_allocate((void **)&w->indices[w->count], whole->triangle_count, 3 * sizeof(uint32_t),
                           "parts of an object", error));
    float *position = w->positions[w->count];
    uint32_t *index = w->indices[w->count], before = 0;
    whole->positions = position;
    whole->indices = index;
    for (size_t i = 0; i < count; ++i) {
        if (parts[i].vertex_count > 0) {
            memcpy(position, parts[i].positions, parts[i].vertex_count * 3 * sizeof *position);
        }
        position += 3 * parts[i].vertex_count;
        for (size_t k = 0; k < 3 * parts[i].triangle_count; ++k) {
            *index++ = before + parts[i].indices[k];
        }
        before += (uint32_t)parts[i].vertex_count;
    }
    return VSH_OK;
}

static vsh_result make_wholes(const vsh_mesh *meshes, size_t mesh_count, vshi_wholes *w, vsh_error *error) {
    *w = (vshi_wholes){0};
    const vshi_array arrays[] = {VSHI_ARRAY(w->meshes, mesh_count), VSHI_ARRAY(w->first, mesh_count + 1),
                                 VSHI_ARRAY(w->positions, mesh_count), VSHI_ARRAY(w->indices, mesh_count)};
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, "objects", error));
    for (size_t m = 0, next; m < mesh_count; m = next) {
        size_t vertices = meshes[m].vertex_count;
        for (next = m + 1; next < mesh_count && one_object(&meshes[m], &meshes[next]) &&
                           vertices + meshes[next].vertex_count <= UINT32_MAX;
             ++next) {
            vertices += meshes[next].vertex_count;
        }
        const vsh_result result = join_parts(meshes + m, next - m, w, error);
        w->first[++w->count] = next; /* free_wholes() frees it after a failure too */
        VSHI_TRY(result);
    }
    return VSH_OK;
}

static void free_wholes(vshi_wholes *w) {
    for (size_t i = 0; i < w->count; ++i) {
        free(w->positions[i]);
        free(w->indices[i]);
    }
    free(w->meshes); /* the block's first array */
}

/* --- the whole analysis */

static vsh_result allocate(vshi_solidity *s, const vsh_mesh *meshes, vsh_error *error) {
    VSHI_TRY(
        vshi_allocate((void **)&s->first_side, s->mesh_count + 1, sizeof *s->first_side, "solids", error));
    for (size_t m = 0; m < s->mesh_count; ++m) {
        s->first_side[m + 1] = s->first_side[m] + meshes[m].triangle_count;
    }
    const size_t triangles = s->first_side[s->mesh_count], wholes = s->wholes.count;
    const vshi_array arrays[] = {VSHI_ARRAY(s->found, wholes),         VSHI_ARRAY(s->first, wholes + 1),
                                 VSHI_ARRAY(s->first_cap, wholes + 1), VSHI_ARRAY(s->turned, triangles),
                                 VSHI_ARRAY(s->sides, triangles),      VSHI_ARRAY(s->holed, triangles)};
    return VSHI_ALLOCATE_BLOCK(arrays, "solids", error);
}

static void set_sides(vshi_solidity *s) {
    for (size_t i = 0; i < s->count; ++i) {
        vshi_component *c = &s->components[i];
        const uint8_t *turned = turned_of(s, c);
        const size_t first = s->first_side[s->wholes.first[c->whole]];
        const bool encloses = c->kind != VSHI_KIND_SHEET;
        for (size_t at = 0; at < c->triangles && (encloses || c->vessel); ++at) {
            const uint32_t triangle = c->list[at];
            const uint8_t side = turned[triangle] ? VSHI_SIDE_BEFORE : VSHI_SIDE_BEHIND;
            s->sides[first + triangle] = encloses ? side : VSHI_SIDE_SHEET;
            s->holed[first + triangle] = c->open_edges > 0 ? side : VSHI_SIDE_SHEET;
            c->turned += encloses && turned[triangle];
        }
    }
}

/* A vshi_element_fn over wholes: finds the components. */
static vsh_result find_components(void *user, size_t w, vsh_error *error) {
    vshi_solidity *s = user;
    const size_t triangles = s->wholes.meshes[w].triangle_count;
    VSHI_TRY(vshi_components_find(&s->wholes.meshes[w], w, &s->found[w], error));
    if (triangles > 0) {
        memcpy(s->turned + s->first_side[s->wholes.first[w]], s->found[w].turned, triangles);
    }
    return VSH_OK;
}

static vsh_result analyse(vshi_solidity *s, vshi_job *job, vsh_error *error) {
    const size_t wholes = s->wholes.count;
    VSHI_TRY(vshi_parallel_each(job, wholes, 1, 1, find_components, s, error));
    for (size_t w = 0; w < wholes; ++w) {
        s->first[w + 1] = s->first[w] + s->found[w].count;
        s->first_cap[w + 1] = s->first_cap[w] + s->found[w].rim_count;
    }
    s->count = s->first[wholes];
    VSHI_TRY(vshi_allocate((void **)&s->components, s->count, sizeof *s->components, "components", error));
    VSHI_TRY(vshi_allocate((void **)&s->caps, s->first_cap[wholes], sizeof *s->caps, "holes", error));
    VSHI_TRY(vshi_parallel_each(job, wholes, 1, 0, measure_whole, s, error));
    VSHI_TRY(find_rooms(s, error));
    set_sides(s);
    return VSH_OK;
}

vsh_result vshi_solidity_create(const vsh_mesh *meshes, size_t mesh_count, const vsh_run *run,
                                vshi_solidity **made, vsh_error *error) {
    *made = NULL;
    double bytes = 0.0;
    for (size_t m = 0; m < mesh_count; ++m) {
        vshi_terrain terrain;
        const bool known = vshi_mesh_is_terrain(&meshes[m], &terrain);
        bytes +=
            (known ? TERRAIN_BYTES_PER_TRIANGLE : BYTES_PER_TRIANGLE) * (double)meshes[m].triangle_count +
            (known ? TERRAIN_BYTES_PER_VERTEX : BYTES_PER_VERTEX) * (double)meshes[m].vertex_count;
    }
    VSHI_TRY(vshi_check_limit(run, bytes, "solids", error));
    vshi_solidity *s = NULL;
    VSHI_TRY(vshi_allocate((void **)&s, 1, sizeof *s, "solids", error));
    s->mesh_count = mesh_count;
    vshi_job *job = NULL;
    vsh_result result;
    VSHI_TRY_DONE(make_wholes(meshes, mesh_count, &s->wholes, error));
    VSHI_TRY_DONE(allocate(s, meshes, error));
    VSHI_TRY_DONE(vshi_job_open(&job, run, "solids", s->wholes.count, "solids", error));
    result = analyse(s, job, error);
done:
    vshi_job_end(job);
    if (result != VSH_OK) {
        vshi_solidity_free(s);
        s = NULL;
    }
    *made = s;
    return result;
}

void vshi_solidity_free(vshi_solidity *s) {
    if (s == NULL) {
        return;
    }
    for (size_t w = 0; s->found != NULL && w < s->wholes.count; ++w) {
        vshi_components_free(&s->found[w]);
    }
    free(s->cuts);
    free(s->caps);
    free(s->components);
    free(s->first_side);
    free(s->found); /* the block's first array */
    free_wholes(&s->wholes);
    free(s);
}

const uint8_t *vshi_solidity_sides(const vshi_solidity *s, size_t mesh) {
    return s->sides + s->first_side[mesh];
}

const uint8_t *vshi_solidity_holed(const vshi_solidity *s, size_t mesh) {
    return s->holed + s->first_side[mesh];
}
