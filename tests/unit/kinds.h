/* Kinds of a mesh's components: solids, rooms, walls and sheets. */
#pragma once

#include "shapes.h"

#include "geometry/solidity.h"

OWNER(vshi_solidity)

static inline vshi_solidity *solidity_of(const vsh_mesh *meshes, size_t count) {
    vshi_solidity *made = NULL;
    assert_ok(vshi_solidity_create(meshes, count, NULL, &made, &failure));
    return made;
}

/* The kinds of all components in their order: "S" solid, "R" room, "W" wall, "-" sheet. */
static inline void assert_kinds(const vsh_mesh *meshes, size_t count, const char *kinds) {
    OWNED(vshi_solidity) *s = solidity_of(meshes, count);
    char found[32] = "";
    for (size_t i = 0; i < s->count && i + 1 < sizeof found; ++i) {
        found[i] = "-SRW"[s->components[i].kind];
    }
    assert_that(strcmp(found, kinds) == 0, "%s: %s, expected %s (encloses %g)", meshes->name, found, kinds,
                s->components[0].enclosed);
}

static inline void assert_kinds_of(shape *s, const char *what, const char *kinds) {
    const vsh_mesh mesh = shape_mesh(s, what);
    assert_kinds(&mesh, 1, kinds);
    s->vertices = s->triangles = 0;
}

/* All triangles of a mesh have this side. */
static inline void assert_sides(const vshi_solidity *s, size_t mesh, const vsh_mesh *of, uint8_t side) {
    const uint8_t *sides = vshi_solidity_sides(s, mesh);
    for (size_t i = 0; i < of->triangle_count; ++i) {
        assert_that(sides[i] == side, "%s: triangle %zu: side %d, expected %d", of->name, i, sides[i], side);
    }
}
