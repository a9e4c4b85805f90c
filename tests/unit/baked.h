/* What test_bits bakes and how it hashes that: solids, lights and points of numbers that need no function of
 * the C library. */
#ifndef TEST_BAKED_H
#define TEST_BAKED_H

#include "grids.h"

#include <stdbool.h>
#include <vdbshade/vdbshade.h>

#include "base/hash.h"

/* --- hashing */

typedef struct bits {
    uint64_t hash;
    size_t values;  /* floats that were hashed */
    size_t changes; /* of them unlike the one before */
} bits;

static void add_floats(bits *b, const float *values, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        uint32_t word;
        memcpy(&word, &values[i], sizeof word);
        b->hash = vshi_mix(b->hash + word + 0x9e3779b97f4a7c15u);
        b->changes += i > 0 && values[i] != values[i - 1];
    }
    b->values += count;
}

static void check(vsh_result result, const vsh_error *error) {
    if (result != VSH_OK) {
        fail_msg("%s: %s", vsh_result_name(result), error->message);
    }
}

/* --- what is baked */

enum { SIDE = 40, POINTS = SIDE * SIDE };

static double positions[3 * POINTS];
static float normals[3 * POINTS];
static uint32_t texels[POINTS];

static double random_unit(uint64_t *counter) {
    return (double)(vshi_mix(++*counter * 0x9e3779b97f4a7c15u) >> 11) * 0x1p-53;
}

/* Rows over the floor, every third point anywhere with a normal to any side. */
static void place_points(void) {
    uint64_t counter = 1;
    for (size_t i = 0; i < POINTS; ++i) {
        double *p = positions + 3 * i;
        float *n = normals + 3 * i;
        p[0] = -2.0 + 4.0 * ((double)(i % SIDE) + 0.5) / SIDE;
        p[1] = 0.001;
        p[2] = -2.0 + 4.0 * ((double)(i / SIDE) + 0.5) / SIDE;
        n[0] = n[2] = 0.0f;
        n[1] = 1.0f;
        texels[i] = (uint32_t)(i % SIDE + 65536 * (i / SIDE));
        for (int axis = 0; axis < 3 && i % 3 == 0; ++axis) {
            p[axis] = -2.0 + 4.0 * random_unit(&counter) + (axis == 1);
            n[axis] = (float)(random_unit(&counter) - 0.4);
        }
    }
}

static vsh_grid *solids(const vsh_run *run) {
    vsh_sdf_node nodes[5];
    for (int i = 0; i < 5; ++i) {
        nodes[i] = vsh_sdf_node_default();
    }
    nodes[0].shape = VSH_SDF_PLANE;
    nodes[0].size[0] = nodes[0].size[2] = 2.5;
    nodes[0].size[1] = 0.25;
    nodes[1].radius = 0.5;
    nodes[1].translation[1] = 0.875;
    nodes[2].shape = VSH_SDF_UNION;
    nodes[2].left = 0;
    nodes[2].right = 1;
    nodes[3].shape = VSH_SDF_TORUS;
    nodes[3].radius = 0.5;
    nodes[3].minor_radius = 0.125;
    nodes[3].rotation[0] = 0.25;
    nodes[3].translation[0] = 1.0;
    nodes[3].translation[1] = 0.75;
    nodes[4].shape = VSH_SDF_UNION;
    nodes[4].left = 2;
    nodes[4].right = 3;
    const vsh_sdf sdf = {nodes, 5};
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = 0.0625;
    vsh_grid *grid = NULL;
    vsh_error error;
    check(vsh_grid_from_sdf(&sdf, &options, run, &grid, &error), &error);
    return grid;
}

static vsh_light sun(void) {
    vsh_light light = vsh_light_default();
    light.direction[0] = 0.5;
    light.direction[2] = 0.25;
    light.angle = 0.25;
    return light;
}

static vsh_light spot(void) {
    vsh_light light = vsh_light_default();
    light.type = VSH_LIGHT_SPOT;
    light.falloff = VSH_FALLOFF_INVERSE_SQUARE;
    light.axis[1] = -1.0;
    light.position[0] = 0.75;
    light.position[1] = 2.5;
    light.position[2] = -0.5;
    light.radius = 0.25;
    strcpy(light.name, "spot");
    return light;
}

static void add_leaves(bits *b, const vsh_grid *grid) {
    leaves all = leaves_of(grid);
    for (size_t i = 0; i < all.count; ++i) {
        add_floats(b, all.leaf[i].values, 512);
    }
    free(all.leaf);
}

#endif
