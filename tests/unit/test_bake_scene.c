/* Lightmaps of a scene by one call, from its files to its rows; also by merged parts. fuzz_part.c and
 * shard.bats damage parts. */
#include "images.h"

/* Rows come 64 at a time. */
enum { SIZE = 384, LIMIT = 4 << 20, SHARDS = 2 };

typedef struct case_scene {
    char mesh[300], output[300];
    vsh_sdf_node ball;
    vsh_caster caster;
    vsh_light sun;
    vsh_receiver receiver;
    vsh_scene scene;
} case_scene;

/* A floor of 4 × 4 units; the ball's middle is `height` above it, its radius 0.6. */
static void fill(case_scene *c, double height) {
    memset(c, 0, sizeof *c);
    snprintf(c->mesh, sizeof c->mesh, "%s", at("floor.obj"));
    snprintf(c->output, sizeof c->output, "%s", at("floor.exr"));
    write_string(c->mesh, "v -2 0 -2\nvt 0 1\nv 2 0 -2\nvt 1 1\nv 2 0 2\nvt 1 0\nv -2 0 2\nvt 0 0\n"
                          "f 1/1 3/3 2/2\nf 1/1 4/4 3/3\n");
    c->scene = vsh_scene_default();
    c->receiver = vsh_receiver_default();
    c->ball = vsh_sdf_node_default();
    c->ball.radius = 0.6;
    c->caster = vsh_caster_default();
    c->caster.type = VSH_CASTER_SDF;
    c->caster.sdf = (vsh_sdf){&c->ball, 1};
    c->caster.transform[7] = height;
    c->sun = vsh_light_default();
    c->sun.angle = 0.1;
    c->receiver.path = c->mesh;
    c->receiver.output = c->output;
    c->receiver.width = c->receiver.height = SIZE;
    c->receiver.ao_spacing = 1;
    c->scene.casters = &c->caster;
    c->scene.caster_count = 1;
    c->scene.lights = &c->sun;
    c->scene.light_count = 1;
    c->scene.receivers = &c->receiver;
    c->scene.receiver_count = 1;
    c->scene.ao = c->scene.irradiance = 1;
    c->scene.grid.resolution = 24;
    c->scene.shade.method = VSH_SHADOW_CONE;
    c->scene.shade.ao_method = VSH_AO_CONES;
    c->scene.shade.ao_distance = 1.0;
}

typedef struct received {
    float *values; /* [channels][SIZE][SIZE] */
    char names[16][VSH_CHANNEL_NAME];
    int32_t channels, rows;
    int calls, fail_at; /* fail_at: the call that fails; 0: none */
} received;

static void free_received(received *t) {
    free(t->values);
}

static vsh_result add_rows(void *user, const vsh_scene_lightmap *lightmap, const vsh_image *image,
                           int32_t first, int32_t count, const float *const *planes, vsh_error *error) {
    received *t = user;
    if (++t->calls == t->fail_at) {
        error->code = VSH_ERROR_WRITE;
        snprintf(error->message, sizeof error->message, "the disk is full");
        return VSH_ERROR_WRITE;
    }
    if (first == 0) {
        assert_int_equal(lightmap->width, image->width);
        assert_null(image->planes);
        t->channels = image->channel_count;
        t->rows = 0;
        t->values = calloc((size_t)image->channel_count * SIZE * SIZE, sizeof(float));
        assert_non_null(t->values);
    }
    assert_int_equal(first, t->rows);
    for (int32_t c = 0; c < t->channels; ++c) {
        snprintf(t->names[c], sizeof t->names[c], "%s", image->names[c]);
        memcpy(t->values + ((size_t)c * SIZE + (size_t)t->rows) * SIZE, planes[c],
               (size_t)count * SIZE * sizeof(float));
    }
    t->rows += count;
    return VSH_OK;
}

static vsh_result bake_into(const case_scene *c, const char *scratch, const vsh_run *run, received *t,
                            vsh_error *error) {
    vsh_bake_options options = vsh_bake_options_default();
    options.rows = add_rows;
    options.user = t;
    options.scratch = scratch;
    return vsh_bake_scene(&c->scene, &options, run, NULL, error);
}

TEST(rows_of_a_callback_are_those_of_the_file_within_any_memory_limit) {
    static const char *const names[] = {"shadow.sun",   "ao",           "irradiance.R",
                                        "irradiance.G", "irradiance.B", "A"};
    case_scene c;
    fill(&c, 1.0);
    vsh_bake_error errors[3];
    vsh_bake_report report = {.errors = errors};
    assert_ok(vsh_bake_scene(&c.scene, NULL, NULL, &report, &failure));
    assert_int_equal(report.texels, SIZE * SIZE);
    assert_int_equal(report.lightmap_count, 1);
    assert_ptr_equal(report.errors, errors);
    assert_true(report.occluders.active_voxels > 0 && report.shade.marches > 0);
    FREED_BY(free_received) received t = {.fail_at = 0}, none = {.fail_at = 0};
    const vsh_run run = run_within(LIMIT); /* planes lie in a file of the folder `scratch` */
    assert_ok(bake_into(&c, at("."), &run, &t, &failure));
    assert_fails(bake_into(&c, at("missing"), &run, &none, &failure), VSH_ERROR_WRITE, "");
    assert_int_equal(t.rows, SIZE);
    assert_int_equal(t.channels, 6);
    OWNED(vsh_image_file) *file = image_from(c.output);
    const vsh_image image = vsh_image_view(file);
    for (int32_t k = 0; k < t.channels; ++k) {
        assert_string_equal(t.names[k], names[k]);
        assert_memory_equal(plane_of(&image, names[k]), t.values + (size_t)k * SIZE * SIZE,
                            SIZE * SIZE * sizeof(float));
    }
    size_t count, told = 0;
    const vsh_attribute *attributes = vsh_image_attributes(file, &count);
    for (size_t i = 0; i < count; ++i) {
        told += strcmp(attributes[i].name, "vdbshade_shadow") == 0;
    }
    assert_int_equal(told, 1);
}

static const char *const words[] = {"one", "", "three words"};

static void bake_parts(const case_scene *c) {
    vsh_bake_options options = vsh_bake_options_default();
    options.words = words;
    options.word_count = 3;
    for (options.shard = 1; options.shard <= SHARDS; ++options.shard) {
        options.shard_count = SHARDS;
        assert_ok(vsh_bake_scene(&c->scene, &options, NULL, NULL, &failure));
    }
}

TEST(merged_parts_have_the_rows_of_one_bake_and_keep_words) {
    case_scene c;
    fill(&c, 0.4);
    FREED_BY(free_received) received one = {.fail_at = 0}, all = {.fail_at = 0};
    assert_ok(bake_into(&c, NULL, NULL, &one, &failure));
    bake_parts(&c);
    vsh_bake_options options = vsh_bake_options_default();
    options.rows = add_rows;
    options.user = &all;
    assert_ok(vsh_merge_scene(&c.scene, &options, NULL, NULL, &failure));
    assert_int_equal(all.rows, SIZE);
    assert_int_equal(all.channels, one.channels);
    assert_memory_equal(one.values, all.values, (size_t)all.channels * SIZE * SIZE * sizeof(float));
    char **kept;
    size_t count;
    assert_ok(vsh_part_words(c.output, 0, NULL, &kept, &count, &failure));
    assert_int_equal(count, 3);
    for (size_t i = 0; i < 3; ++i) {
        assert_string_equal(kept[i], words[i]);
    }
    assert_null(kept[3]);
    vsh_part_words_free(kept);
}

TEST(options_that_a_part_cannot_have_are_refused) {
    static const struct {
        int32_t shard, shard_count;
        bool rows, words;
    } wrong[] = {{.shard = 1},
                 {.shard = 2, .shard_count = 1},
                 {.shard = -1, .shard_count = 3},
                 {.shard = 1, .shard_count = 10001},
                 {.shard = 1, .shard_count = -1},
                 {.shard = 1, .shard_count = 2, .rows = true},
                 {.shard = 1, .shard_count = 2, .words = true}};
    case_scene c;
    fill(&c, 0.4);
    for (size_t i = 0; i < COUNT_OF(wrong); ++i) {
        vsh_bake_options options = vsh_bake_options_default();
        options.shard = wrong[i].shard;
        options.shard_count = wrong[i].shard_count;
        options.rows = wrong[i].rows ? add_rows : NULL;
        options.word_count = wrong[i].words;
        assert_fails(vsh_bake_scene(&c.scene, &options, NULL, NULL, &failure), VSH_ERROR_ARGUMENT, "");
    }
}

TEST(an_error_of_the_callback_ends_the_bake) {
    case_scene c;
    fill(&c, 1.0);
    FREED_BY(free_received) received t = {.fail_at = 2};
    assert_fails(bake_into(&c, NULL, NULL, &t, &failure), VSH_ERROR_WRITE, "the disk is full");
    assert_int_equal(t.calls, 2);
}

/* The lightmaps that `loaded` is called with. */
typedef struct loading {
    char output[300];
    size_t count;
    uint64_t covered;
    int refuses;
} loading;

static vsh_result note_loaded(void *user, const vsh_scene_lightmap *lightmaps, size_t count,
                              vsh_error *error) {
    loading *l = user;
    l->count = count;
    l->covered = lightmaps[0].covered;
    snprintf(l->output, sizeof l->output, "%s", lightmaps[0].output);
    if (l->refuses) {
        snprintf(error->message, sizeof error->message, "no");
        return VSH_ERROR_INPUT;
    }
    return VSH_OK;
}

TEST(lightmaps_are_known_before_anything_is_baked) {
    case_scene c;
    fill(&c, 1.0);
    unlink(c.output);
    loading l = {.refuses = 1};
    vsh_bake_options options = vsh_bake_options_default();
    options.loaded = note_loaded;
    options.user = &l;
    assert_fails(vsh_bake_scene(&c.scene, &options, NULL, NULL, &failure), VSH_ERROR_INPUT, "no");
    assert_true(l.count == 1 && l.covered == 0);
    assert_string_equal(l.output, c.output);
    assert_int_equal(access(c.output, F_OK), -1);
}

TEST(bad_outputs_are_refused_before_a_file_is_read) {
    case_scene c;
    fill(&c, 1.0);
    unlink(c.mesh);
    c.receiver.output = "floor.xyz";
    assert_fails(vsh_bake_scene(&c.scene, NULL, NULL, NULL, &failure), VSH_ERROR_ARGUMENT, "floor.xyz");
    c.receiver.output = c.output;
    assert_fails(vsh_bake_scene(&c.scene, NULL, NULL, NULL, &failure), VSH_ERROR_READ, "");
    c.scene.receiver_count = 0;
    assert_fails(vsh_bake_scene(&c.scene, NULL, NULL, NULL, &failure), VSH_ERROR_ARGUMENT, "");
    assert_fails(vsh_receiver_check(&c.scene, 0, &failure), VSH_ERROR_ARGUMENT, "");
}

FIXTURE(make_folder, remove_folder)
