/* A sample that a ray links to the one before gets the same result, inside a solid or outside
 * (src/shade/inside.c, src/lightmap/origins.c). The tests compare with each sample tested alone. */
#include "handles.h"
#include "lightmap/texels.h"
#include "shade/shade.h"
#include "testing.h"

typedef struct counts {
    size_t samples, invalid, other; /* `other`: with another result than alone */
} counts;

/* Bakes meshes without voxels, and looks at each sample on a flat triangle anew. */
static counts compare(const vsh_mesh *meshes, size_t mesh_count, int32_t size) {
    OWNED(vshi_triangles) *triangles = triangles_from(meshes, mesh_count);
    OWNED(vsh_occluders) *occluders = occluders_from_triangles(triangles);
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = options.height = size;
    options.ao_spacing = 1;
    options.shade.ao_method = VSH_AO_EXACT;
    options.shade.ao_distance = 0.1;
    options.shade.rays = 4;
    OWNED(vsh_charts) *charts = charts_from(meshes, mesh_count, &options);
    OWNED(texel_list) *texels = texels_from(charts);
    const vshi_samples *samples = &texels->all;
    const size_t count = (size_t)size * (size_t)size;
    FREED float *ao = calloc(count, sizeof *ao), *coverage = calloc(count, sizeof *coverage);
    const vsh_lightmap lightmap = {.ao = ao, .coverage = coverage};
    assert_ok(vsh_bake_lightmap(occluders, charts, NULL, 0, NULL, NULL, &lightmap, NULL, &failure));
    counts found = {0, 0, 0};
    for (size_t i = 0; i < samples->count; ++i) {
        const float *lift = samples->lift + 3 * i;
        if (lift[0] != 0.0f || lift[1] != 0.0f || lift[2] != 0.0f) {
            continue;
        }
        uint8_t where;
        vshi_inside(triangles, 1, samples->position + 3 * i, samples->geometric + 3 * i, NULL, NULL, &where);
        const bool valid = coverage[vsh_texel_place(samples->texel[i], size)] == 1.0f;
        ++found.samples;
        found.invalid += where != VSHI_OUTSIDE;
        found.other += valid != (where == VSHI_OUTSIDE);
    }
    return found;
}

/* Walls whose arches stand in them, columns on their bases, all solids: charts end where others begin. */
TEST(samples_of_solids_in_each_other_are_where_they_are_by_themselves) {
    OWNED(vsh_model) *model = model_from(VSH_ASSETS "/cloister.glb");
    const size_t mesh_count = vsh_model_mesh_count(model);
    FREED vsh_mesh *meshes = calloc(mesh_count, sizeof *meshes);
    for (size_t i = 0; i < mesh_count; ++i) {
        meshes[i] = vsh_model_mesh(model, i, -1);
    }
    const counts found = compare(meshes, mesh_count, 512);
    assert_true(found.samples > 100000 && found.invalid > 10000);
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
    const vsh_mesh mesh = mesh_of_arrays("hood", positions, uvs, 12, indices, 12);
    const counts found = compare(&mesh, 1, 256);
    /* a ray that climbs by 0.06 escapes within 0.04 / 0.06 of the rim: the rest is a square, and a little
     * where none of the directions goes straight to the rim */
    const double side = 2.0 - 2.0 * 0.04 / 0.06, square = side * side / 16.0 * (double)found.samples;
    assert_true((double)found.invalid >= 0.99 * square && (double)found.invalid < 1.3 * square);
    assert_int_equal(found.other, 0);
}
