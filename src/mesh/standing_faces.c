/* The faces that may close holes: those whose boxes are near a vessel's, told by cells of the box around all
 * vessels, so that a million triangles cost little where few are near. */
#include "base/elementary.h"
#include "base/memory.h"
#include "base/try.h"
#include "mesh/standing.h"

#include <stdlib.h>

static const double CELLS = 0x1p18; /* about as many */
enum { MOST_CELLS = 1024 };         /* along a side */

typedef struct cells {
    vshi_vec low;
    double per_unit;
    int count[3];
    uint8_t *near; /* [count[0] * count[1] * count[2]] */
} cells;

typedef struct box {
    vshi_vec low, high;
} box;

static void corners_of(const void *user, vshi_face face, vshi_vec corner[3]) {
    const vshi_solidity *s = user;
    const vshi_component *c = &s->components[face.component];
    if (face.number < c->triangles) {
        const vshi_surface_part part = vshi_component_part(s, c);
        vshi_part_corners(&part, face.number, corner);
        return;
    }
    for (int k = 0; k < 3; ++k) {
        corner[k] = c->cap[face.number - c->triangles][k];
    }
}

/* A vessel's box, and as much around it as a point beyond a hole is off. */
static box around(const vshi_component *c) {
    const double by = VSHI_STANDING_GAP * vshi_length(vshi_sub(c->high, c->low));
    const vshi_vec more = {by, by, by};
    return (box){vshi_sub(c->low, more), vshi_add(c->high, more)};
}

static void grow(box *b, vshi_vec p) {
    b->low.x = p.x < b->low.x ? p.x : b->low.x;
    b->low.y = p.y < b->low.y ? p.y : b->low.y;
    b->low.z = p.z < b->low.z ? p.z : b->low.z;
    b->high.x = p.x > b->high.x ? p.x : b->high.x;
    b->high.y = p.y > b->high.y ? p.y : b->high.y;
    b->high.z = p.z > b->high.z ? p.z : b->high.z;
}

static int cell_at(double offset, double per_unit, int count) {
    const double at = offset * per_unit;
    return at > 0.0 ? (at < count - 1 ? (int)at : count - 1) : 0;
}

/* Marks the cells of a box, or looks for one that is marked. */
static bool visit(cells *c, const box *b, bool marks) {
    const vshi_vec from = vshi_sub(b->low, c->low), to = vshi_sub(b->high, c->low);
    const int first[3] = {cell_at(from.x, c->per_unit, c->count[0]),
                          cell_at(from.y, c->per_unit, c->count[1]),
                          cell_at(from.z, c->per_unit, c->count[2])};
    const int last[3] = {cell_at(to.x, c->per_unit, c->count[0]), cell_at(to.y, c->per_unit, c->count[1]),
                         cell_at(to.z, c->per_unit, c->count[2])};
    for (int x = first[0]; x <= last[0]; ++x) {
        for (int y = first[1]; y <= last[1]; ++y) {
            uint8_t *row = c->near + ((size_t)x * (size_t)c->count[1] + (size_t)y) * (size_t)c->count[2];
            for (int z = first[2]; z <= last[2]; ++z) {
                if (marks) {
                    row[z] = 1;
                } else if (row[z]) {
                    return true;
                }
            }
        }
    }
    return false;
}

static bool apart(const box *a, const box *b) {
    return a->low.x > b->high.x || a->high.x < b->low.x || a->low.y > b->high.y || a->high.y < b->low.y ||
           a->low.z > b->high.z || a->high.z < b->low.z;
}

/* Cubes, as many as CELLS in a box. */
static void divide(cells *c, const box *all) {
    double side[3] = {all->high.x - all->low.x, all->high.y - all->low.y, all->high.z - all->low.z};
    const double longest = fmax(side[0], fmax(side[1], side[2]));
    for (int axis = 0; axis < 3; ++axis) {
        side[axis] = fmax(side[axis], longest / MOST_CELLS);
    }
    const double cell = fmax(vshi_cbrt(side[0] * side[1] * side[2] / CELLS), longest / MOST_CELLS);
    c->low = all->low;
    c->per_unit = cell > 0.0 ? 1.0 / cell : 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        c->count[axis] = cell > 0.0 ? (int)fmin(ceil(side[axis] / cell), MOST_CELLS) : 1;
    }
}

/* Marks what is near vessels; `all` becomes the box around all of it. */
static vsh_result mark(const vshi_solidity *s, cells *c, box *all, vsh_error *error) {
    *all = (box){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    for (size_t i = 0; i < s->count; ++i) {
        if (s->components[i].vessel) {
            const box b = around(&s->components[i]);
            grow(all, b.low);
            grow(all, b.high);
        }
    }
    divide(c, all);
    VSHI_TRY(vshi_allocate((void **)&c->near, (size_t)c->count[0] * (size_t)c->count[1], (size_t)c->count[2],
                           "what stands on something", error));
    for (size_t i = 0; i < s->count; ++i) {
        if (s->components[i].vessel) {
            const box b = around(&s->components[i]);
            visit(c, &b, true);
        }
    }
    return VSH_OK;
}

/* Counts the faces that are near, and lists them where `faces` is given. */
static size_t list(const vshi_solidity *s, cells *c, const box *all, vshi_face *faces) {
    size_t count = 0;
    for (size_t i = 0; i < s->count; ++i) {
        const vshi_component *component = &s->components[i];
        const box whole = {component->low, component->high};
        if (apart(&whole, all) || !visit(c, &whole, false)) {
            continue;
        }
        const size_t caps = component->kind == VSHI_KIND_SOLID ? component->open_edges : 0;
        for (size_t at = 0; at < component->triangles + caps; ++at) {
            const vshi_face face = {(uint32_t)i, (uint32_t)at};
            vshi_vec corner[3];
            corners_of(s, face, corner);
            box b = {corner[0], corner[0]};
            grow(&b, corner[1]);
            grow(&b, corner[2]);
            if (!apart(&b, all) && visit(c, &b, false)) {
                if (faces != NULL) {
                    faces[count] = face;
                }
                ++count;
            }
        }
    }
    return count;
}

vsh_result vshi_faces_near_vessels(const vshi_solidity *s, vshi_face **faces, vshi_face_tree **tree,
                                   vsh_error *error) {
    cells c = {.near = NULL};
    box all;
    *faces = NULL;
    *tree = NULL;
    vsh_result result;
    VSHI_TRY(mark(s, &c, &all, error));
    const size_t count = list(s, &c, &all, NULL);
    VSHI_TRY_DONE(vshi_allocate((void **)faces, count, sizeof **faces, "what stands on something", error));
    list(s, &c, &all, *faces);
    result = vshi_face_tree_create(*faces, count, corners_of, s, tree, error);
done:
    free(c.near);
    return result;
}
