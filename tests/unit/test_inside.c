/* Samples that a ray links to the one before take over what is said of it (src/shade/inside.c,
 * src/bake/origins.c): held against each sample looked at by itself. */
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#include "bake/texels.h"
#include "shade/inside.h"
#include "testing.h"

#include <vdbshade/vdbshade.h>

static void check(vsh_result result, const vsh_error *error) {
    if (result != VSH_OK) {
        fail_msg("%s", error->message);
    }
}

typedef struct counts {
    size_t samples, invalid, other; /* that are said to be elsewhere than by themselves */
} counts;

/* Bakes meshes without voxels, and looks at each sample on a flat triangle anew. */
static counts compare(const vsh_mesh *meshes, size_t mesh_count, int32_t size) {
    OWNED(vsh_triangles) *triangles = NULL;
    OWNED(vsh_occluders) *occluders = NULL;
    OWNED(vsh_charts) *charts = NULL;
    OWNED(vsh_texels) *texels = NULL;
    check(vsh_triangles_create(meshes, mesh_count, NULL, &triangles, &failure), &failure);
    vsh_occluder_parts parts = vsh_occluder_parts_default();
    parts.triangles = triangles;
    check(vsh_occluders_from_parts(&parts, &occluders, &failure), &failure);
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = options.height = size;
    options.ao_spacing = 1;
    options.shade.ao_method = VSH_AO_EXACT;
    options.shade.ao_distance = 0.1;
    options.shade.rays = 4;
    check(vsh_charts_create(meshes, mesh_count, &options, NULL, NULL, &charts, &failure), &failure);
    check(vsh_texels_create(charts, NULL, &texels, &failure), &failure);
    const vshi_samples *samples = &texels->samples;
    const size_t count = (size_t)size * (size_t)size;
    FREED float *ao = calloc(count, sizeof *ao), *coverage = calloc(count, sizeof *coverage);
    const vsh_lightmap lightmap = {.ao = ao, .coverage = coverage};
    check(vsh_bake_lightmap(occluders, charts, NULL, 0, NULL, NULL, &lightmap, NULL, &failure), &failure);
    counts found = {0, 0, 0};
    for (size_t i = 0; i < samples->count; ++i) {
        const float *lift = samples->lift + 3 * i;
        if (lift[0] != 0.0f || lift[1] != 0.0f || lift[2] != 0.0f) {
            continue;
        }
        uint8_t where;
        vshi_inside(triangles, 1, samples->position + 3 * i, samples->geometric + 3 * i, NULL, NULL, NULL,
                    &where);
        const bool valid = coverage[vsh_texel_place(samples->texel[i], size)] == 1.0f;
        ++found.samples;
        found.invalid += where != VSHI_OUTSIDE;
        found.other += valid != (where == VSHI_OUTSIDE);
    }
    return found;
}

/* Walls whose arches stand in them, columns on their bases, all solids: charts end where others begin. */
TEST(samples_of_solids_in_each_other_are_where_they_are_by_themselves) {
    OWNED(vsh_model) *model = NULL;
    check(vsh_model_read(VSH_ASSETS "/cloister.glb", NULL, &model, &failure), &failure);
    const size_t mesh_count = vsh_model_mesh_count(model);
    FREED vsh_mesh *meshes = calloc(mesh_count, sizeof *meshes);
    for (size_t i = 0; i < mesh_count; ++i) {
        meshes[i] = vsh_model_mesh(model, i, -1);
    }
    const counts found = compare(meshes, mesh_count, 512);
    print_message("%zu samples, %zu in solids, %zu said to be elsewhere\n", found.samples, found.invalid,
                  found.other);
    assert_true(found.samples > 100000 && found.invalid > 10000);
    assert_int_equal(found.other, 0);
}

enum { RINGS = 24, SECTORS = 32, BALLS = 2, QUADS = BALLS * RINGS * SECTORS };

typedef struct head {
    float positions[12 * QUADS], uvs[8 * QUADS];
    uint32_t indices[6 * QUADS];
    size_t quads;
} head;

/* Adds a ball around a place on the z axis without what is nearer to the axis than `hole` radians, as charts
 * of a quad each, in half of the lightmap. */
static void add_ball(head *h, double radius, double z, double hole, float left) {
    const double pi = 3.14159265358979323846;
    static const uint32_t order[6] = {0, 1, 2, 0, 2, 3};
    for (size_t ring = 0; ring < RINGS; ++ring) {
        for (size_t sector = 0; sector < SECTORS; ++sector) {
            const size_t q = h->quads++;
            for (size_t k = 0; k < 4; ++k) {
                const size_t down = k == 1 || k == 2, around = k >= 2;
                const double a = hole + (pi - hole) * (double)(ring + down) / RINGS;
                const double b = 2.0 * pi * (double)((sector + around) % SECTORS) / SECTORS;
                const double across = ring + down == RINGS ? 0.0 : radius * sin(a);
                float *p = h->positions + 12 * q + 3 * k;
                p[0] = (float)(across * cos(b));
                p[1] = (float)(across * sin(b));
                p[2] = (float)(z + radius * cos(a));
                h->uvs[8 * q + 2 * k] = left + 0.5f * ((float)sector + 0.1f + 0.8f * (float)around) / SECTORS;
                h->uvs[8 * q + 2 * k + 1] = ((float)ring + 0.1f + 0.8f * (float)down) / RINGS;
            }
            for (size_t k = 0; k < 6; ++k) {
                h->indices[6 * q + k] = (uint32_t)(4 * q) + order[k];
            }
        }
    }
}

/* A head with a hole, and an eye that looks out of it: how many rays find their way grows over the eye. */
TEST(samples_beside_a_hole_are_where_they_are_by_themselves) {
    FREED head *h = calloc(1, sizeof *h);
    add_ball(h, 1.0, 0.0, 0.35, 0.0f);
    add_ball(h, 0.4, 0.5, 0.0, 0.5f);
    const vsh_mesh mesh = {.name = "head",
                           .positions = h->positions,
                           .uvs = h->uvs,
                           .indices = h->indices,
                           .vertex_count = 4 * h->quads,
                           .triangle_count = 2 * h->quads};
    const counts found = compare(&mesh, 1, 1024);
    print_message("%zu samples, %zu in the head, %zu said to be elsewhere\n", found.samples, found.invalid,
                  found.other);
    assert_true(found.samples > 100000 && found.invalid > 10000 && found.invalid < found.samples / 2);
    assert_int_equal(found.other, 0);
}

/* A hood, which is a box without its bottom, over a floor. Points deep below it see its inner sides alone,
 * others see out by the gap, and no triangle parts the two. */
TEST(samples_below_a_hood_are_where_they_are_by_themselves) {
    static const float positions[] = {-2, -2, 0,     2, -2, 0,     2, 2, 0,     -2, 2, 0,
                                      -1, -1, 0.04f, 1, -1, 0.04f, 1, 1, 0.04f, -1, 1, 0.04f,
                                      -1, -1, 1,     1, -1, 1,     1, 1, 1,     -1, 1, 1};
    static const float uvs[] = {0, 0, 1, 0, 1, 1, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    static const uint32_t indices[] = {0, 1, 2,  0, 2,  3,  4, 5, 9, 4, 9, 8,  5, 6, 10, 5, 10, 9,
                                       6, 7, 11, 6, 11, 10, 7, 4, 8, 7, 8, 11, 8, 9, 10, 8, 10, 11};
    const vsh_mesh mesh = {.name = "hood",
                           .positions = positions,
                           .uvs = uvs,
                           .indices = indices,
                           .vertex_count = 12,
                           .triangle_count = 12};
    const counts found = compare(&mesh, 1, 256);
    print_message("%zu samples, %zu hidden, %zu said to be elsewhere\n", found.samples, found.invalid,
                  found.other);
    /* a ray that climbs by 0.06 escapes within 0.04 / 0.06 of the rim: the rest is a square, and a little
     * where none of the directions goes straight to the rim */
    const double side = 2.0 - 2.0 * 0.04 / 0.06, square = side * side / 16.0 * (double)found.samples;
    assert_true((double)found.invalid >= 0.99 * square && (double)found.invalid < 1.3 * square);
    assert_int_equal(found.other, 0);
}
