/* Lightmaps that are baked in two parts and merged into arrays. */
#ifndef TEST_PARTS_H
#define TEST_PARTS_H

#include "floor_under_ball.h"

enum { SIZE = 80, SHARDS = 2, CHANNELS = 12 };

/* Rows as they come. */
typedef struct taken {
    float values[CHANNELS][SIZE * SIZE];
    int32_t rows, channels;
} taken;

static inline vsh_result add_rows(void *user, const vsh_scene_lightmap *lightmap, const vsh_image *image,
                                  int32_t first, int32_t count, const float *const *planes,
                                  vsh_error *error) {
    (void)lightmap;
    (void)error;
    taken *t = user;
    assert_in_range(image->channel_count, 1, CHANNELS);
    assert_true(first + count <= SIZE);
    for (int32_t c = 0; c < image->channel_count; ++c) {
        memcpy(t->values[c] + first * SIZE, planes[c], (size_t)count * SIZE * sizeof(float));
    }
    t->rows = first + count;
    t->channels = image->channel_count;
    return VSH_OK;
}

static inline vsh_bake_options options_of(taken *t) {
    vsh_bake_options options = vsh_bake_options_default();
    options.rows = add_rows;
    options.user = t;
    return options;
}

static inline void bake_parts(const case_scene *c) {
    static const char *const words[] = {"one", "", "three words"};
    for (int32_t i = 1; i <= SHARDS; ++i) {
        vsh_bake_options options = vsh_bake_options_default();
        options.shard = i;
        options.shard_count = SHARDS;
        options.words = words;
        options.word_count = 3;
        vsh_error error;
        assert_ok(vsh_bake_scene(&c->scene, &options, NULL, NULL, &error), &error);
    }
}

static inline vsh_result merge(const case_scene *c, taken *t, const vsh_run *run, vsh_error *error) {
    const vsh_bake_options options = options_of(t);
    return vsh_merge_scene(&c->scene, &options, run, NULL, error);
}

/* The ball becomes a wall that stands on the floor, to which rays of AO go that texels share. `made`: with
 * all that is made of AO. */
static inline void fill_traced(case_scene *c, char wall[300], bool made) {
    fill(c, SIZE, 0.4);
    snprintf(wall, 300, "%s", at("wall.obj"));
    FILE *file = fopen(wall, "wb");
    assert_non_null(file);
    fprintf(file, "v -2 -1 0\nv 1 -1 0\nv 1 1 0.5\nv -2 1 0.5\nf 1 2 3\nf 1 3 4\n");
    assert_int_equal(fclose(file), 0);
    c->caster.type = VSH_CASTER_MESH;
    c->caster.path = wall;
    c->caster.transform[7] = 0.0;
    c->receiver.ao_spacing = 2;
    c->scene.irradiance = made;
    c->scene.bent = made ? 1 + VSH_BENT_TANGENT : 0;
    c->scene.planes.sky = made ? VSH_UP_Y : VSH_UP_NONE;
    c->scene.error = 1;
    c->scene.shade.method = VSH_SHADOW_EXACT;
    c->scene.shade.ao_method = VSH_AO_EXACT;
}

#endif
