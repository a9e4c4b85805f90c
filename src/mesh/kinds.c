/* Tells solids, walls and sheets apart, each component for itself. */
#include "base/elementary.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "mesh/solidity_parts.h"
#include "mesh/weld.h"

#include <stdlib.h>

/* Of one that looks inwards: nothing is filled behind its faces but a thin wall, so that a room may lack a
 * whole side. */
static const double WALL_ENCLOSES = 0.86;
/* Of the area, at least, that must look inwards: where faces disagree more, what is closed is solid. */
static const double INWARD_SHARE = 2.0 / 3.0;
/* Volume over the area to the power of 1.5: less is what rounding leaves of none. A sphere has 0.094. */
static const double LEAST_VOLUME = 1e-6;
/* Of the area that is given once more facing the other way: such faces are double-sided sheets. */
static const double DOUBLED_SHARE = 0.5;

/* --- generalized winding numbers (A. Jacobson, L. Kavan, O. Sorkine-Hornung, "Robust inside-outside
 * segmentation using generalized winding numbers", 2013): the sum of the triangles' solid angles over the
 * whole sphere's */

static const double PI = 3.14159265358979323846;

/* Points of a surface from which part_encloses() looks. It takes fewer where the surface has many open edges,
 * to sum no more solid angles than this. */
enum { MOST_SAMPLES = 128, FEWEST_SAMPLES = 16, MOST_ANGLES = 1 << 21 };

void vshi_part_corners(const vshi_surface_part *part, size_t at, vshi_vec corner[3]) {
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
    if (over == 0.0) { /* in its plane: on it, half of the sphere on either side */
        return 0.0;
    }
    return 2.0 *
           vshi_atan2(over, la * lb * lc + vshi_dot(a, b) * lc + vshi_dot(b, c) * la + vshi_dot(c, a) * lb);
}

double vshi_winding(const vshi_surface_part *part, vshi_vec point) {
    double sum = 0.0;
    for (size_t at = 0; at < part->count; ++at) {
        vshi_vec corner[3];
        vshi_part_corners(part, at, corner);
        sum += solid_angle(corner, point);
    }
    return sum / (4.0 * PI);
}

/* The fractions of the additive sequence of the plastic number (M. Roberts, 2018). */
vshi_vec vshi_point_in(const vshi_vec corner[3], size_t number) {
    double u = 0.5 + 0.7548776662466927 * (double)number, v = 0.5 + 0.5698402909980532 * (double)number;
    u -= floor(u);
    v -= floor(v);
    if (u + v > 1.0) {
        u = 1.0 - u;
        v = 1.0 - v;
    }
    return vshi_add(corner[0], vshi_add(vshi_scale(vshi_sub(corner[1], corner[0]), u),
                                        vshi_scale(vshi_sub(corner[2], corner[0]), v)));
}

void vshi_part_samples(const vshi_surface_part *part, double area, size_t count, vshi_vec *samples) {
    double reached = 0.0;
    size_t next = 0;
    vshi_vec corner[3] = {{0.0, 0.0, 0.0}};
    for (size_t at = 0; at < part->count && next < count; ++at) {
        vshi_part_corners(part, at, corner);
        reached +=
            0.5 * vshi_length(vshi_cross(vshi_sub(corner[1], corner[0]), vshi_sub(corner[2], corner[0])));
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
 * triangles over its holes. A surface and what closes it go around a point a whole number of times, so that
 * what the surface itself lacks of one is what its caps go around it: only those need to be summed. */
static double part_encloses(const vshi_surface_part *part, double area, const vshi_vec (*caps)[3],
                            size_t cap_count) {
    if (cap_count == 0) {
        return 1.0;
    }
    vshi_vec samples[MOST_SAMPLES];
    size_t count = MOST_ANGLES / cap_count;
    count = count < FEWEST_SAMPLES ? FEWEST_SAMPLES : count > MOST_SAMPLES ? MOST_SAMPLES : count;
    vshi_part_samples(part, area, count, samples);
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

static void grow(vshi_component *c, vshi_vec p) {
    c->low = (vshi_vec){fmin(c->low.x, p.x), fmin(c->low.y, p.y), fmin(c->low.z, p.z)};
    c->high = (vshi_vec){fmax(c->high.x, p.x), fmax(c->high.y, p.y), fmax(c->high.z, p.z)};
}

/* Six times the volume of the tetrahedron over a triangle from `origin`. */
static double volume_from(const vshi_vec corner[3], vshi_vec origin) {
    return vshi_dot(vshi_sub(corner[0], origin),
                    vshi_cross(vshi_sub(corner[1], origin), vshi_sub(corner[2], origin)));
}

vshi_surface_part vshi_component_part(const vshi_solidity *s, const vshi_component *c) {
    return (vshi_surface_part){&s->wholes.meshes[c->whole], c->list, c->triangles,
                               vshi_solidity_turned(s, c)};
}

static measure measure_component(const vshi_solidity *s, vshi_component *c) {
    const vshi_components *found = &s->found[c->whole];
    const vshi_surface_part part = vshi_component_part(s, c);
    measure m = {0.0, 0.0};
    double volume = 0.0;
    vshi_vec origin = {0.0, 0.0, 0.0};
    c->low = (vshi_vec){INFINITY, INFINITY, INFINITY};
    c->high = (vshi_vec){-INFINITY, -INFINITY, -INFINITY};
    for (size_t at = 0; at < c->triangles; ++at) {
        const uint32_t i = c->list[at];
        vshi_vec corner[3];
        vshi_part_corners(&part, at, corner);
        origin = at == 0 ? corner[0] : origin;
        const double area =
            0.5 * vshi_length(vshi_cross(vshi_sub(corner[1], corner[0]), vshi_sub(corner[2], corner[0])));
        c->area += area;
        m.turned_area += part.turned[i] ? area : 0.0;
        m.doubled_area += found->doubled[i] ? area : 0.0;
        volume += volume_from(corner, origin);
        for (int k = 0; k < 3; ++k) {
            grow(c, corner[k]);
        }
    }
    for (size_t k = 0; k < c->open_edges; ++k) {
        volume += volume_from(c->cap[k], origin);
    }
    c->volume = volume / 6.0;
    return m;
}

/* Turns what encloses something to face the other way. */
static void turn_component(vshi_solidity *s, vshi_component *c) {
    uint8_t *turned = vshi_solidity_turned(s, c);
    for (size_t at = 0; at < c->triangles; ++at) {
        turned[c->list[at]] ^= 1;
    }
    for (size_t k = 0; k < c->open_edges; ++k) {
        vshi_vec *corner = s->caps[(size_t)(c->cap - (const vshi_vec(*)[3])s->caps) + k];
        const vshi_vec swapped = corner[0];
        corner[0] = corner[1];
        corner[1] = swapped;
    }
}

/* --- holes: each group of open edges that hang together is closed by triangles to its middle */

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
    if (turned_area > 0.5 * c->area) { /* most are right */
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
    const vshi_surface_part part = vshi_component_part(s, c);
    c->enclosed = part_encloses(&part, c->area, c->cap, c->open_edges);
    const bool single = m->doubled_area < DOUBLED_SHARE * c->area;
    const bool encloses = c->enclosed >= (inward ? WALL_ENCLOSES : VSHI_SOLID_ENCLOSES) && single;
    if (asked != VSH_SOLIDITY_SHELL && (encloses || asked != VSH_SOLIDITY_AUTO)) {
        c->kind = inward ? VSHI_KIND_WALL : VSHI_KIND_SOLID;
        c->inward = inward;
    }
    c->vessel = c->kind == VSHI_KIND_SHEET && c->open_edges > 0 && asked == VSH_SOLIDITY_AUTO && !inward &&
                agreed && single;
}

/* Wholes that are looked at, each for itself. */
typedef struct telling {
    vshi_solidity *s;
    size_t *first_cap; /* [wholes] */
} telling;

/* A vshi_element_fn over wholes. */
static vsh_result find_of_whole(void *user, size_t whole, vsh_error *error) {
    const telling *t = user;
    vshi_solidity *s = t->s;
    size_t caps = t->first_cap[whole];
    const vshi_components *found = &s->found[whole];
    closing k = {.mesh = &s->wholes.meshes[whole]};
    const size_t vertices = found->rim_count > 0 ? k.mesh->vertex_count : 0;
    const vshi_array arrays[] = {VSHI_ARRAY(k.parent, vertices), VSHI_ARRAY(k.number, vertices),
                                 VSHI_ARRAY(k.holes, found->rim_count)};
    vsh_result result;
    VSHI_TRY_DONE(VSHI_ALLOCATE_ALL(arrays, "holes", error));
    for (size_t i = 0, rim = 0; i < found->count; ++i) {
        vshi_component *c = &s->components[s->first[whole] + i];
        *c = (vshi_component){.whole = (uint32_t)whole,
                              .triangles = found->begin[i + 1] - found->begin[i],
                              .list = found->list + found->begin[i],
                              .cap = s->caps != NULL ? (const vshi_vec(*)[3])(s->caps + caps) : NULL};
        while (rim + c->open_edges < found->rim_count && found->rims[rim + c->open_edges].component == i) {
            ++c->open_edges;
        }
        if (c->open_edges > 0) { // where no edge is open there is no memory of them
            c->holes = close_holes(&k, found->rims + rim, c->open_edges, s->caps + caps);
            rim += c->open_edges;
            caps += c->open_edges;
        }
        const measure m = measure_component(s, c);
        decide(s, c, &m);
    }
done:
    free(k.holes);
    free(k.number);
    free(k.parent);
    return result;
}

vsh_result vshi_kinds_find(vshi_solidity *s, vshi_job *job, vsh_error *error) {
    telling t = {.s = s};
    VSHI_TRY(vshi_allocate((void **)&t.first_cap, s->wholes.count + 1, sizeof *t.first_cap, "holes", error));
    for (size_t w = 0; w < s->wholes.count; ++w) {
        t.first_cap[w + 1] = t.first_cap[w] + s->found[w].rim_count;
    }
    const vsh_result result = vshi_parallel_each(job, s->wholes.count, 1, 0, find_of_whole, &t, error);
    free(t.first_cap);
    return result;
}
