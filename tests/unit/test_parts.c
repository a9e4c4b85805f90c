/* Parts of lightmaps and volumes, by the library: what merging takes, and that no file makes it do worse than
 * fail. */
#include "floor_under_ball.h"

#include "base/part_file.h"
#include "base/part_sum.h"

enum { SIZE = 48, SHARDS = 2, CHANNELS = 12 };

/* Rows as they come. */
typedef struct taken {
    float values[CHANNELS][SIZE * SIZE];
    int32_t rows, channels;
} taken;

static vsh_result begin(void *user, const vsh_job_lightmap *lightmap, const vsh_image *image,
                        vsh_error *error) {
    (void)lightmap;
    (void)error;
    taken *t = user;
    t->rows = 0;
    t->channels = image->channel_count;
    assert_in_range(image->channel_count, 1, CHANNELS);
    return VSH_OK;
}

static vsh_result add(void *user, int32_t rows, const float *const *planes, vsh_error *error) {
    (void)error;
    taken *t = user;
    assert_true(t->rows + rows <= SIZE);
    for (int32_t c = 0; c < t->channels; ++c) {
        memcpy(t->values[c] + t->rows * SIZE, planes[c], (size_t)rows * SIZE * sizeof(float));
    }
    t->rows += rows;
    return VSH_OK;
}

static vsh_result end(void *user, vsh_result result, vsh_error *error) {
    (void)user;
    (void)error;
    return result;
}

static vsh_row_sink sink_of(taken *t) {
    return (vsh_row_sink){sizeof(vsh_row_sink), begin, add, end, t};
}

static void bake_parts_of(const case_scene *c, double least) {
    static const char *const words[] = {"one", "", "three words"};
    for (int32_t i = 1; i <= SHARDS; ++i) {
        vsh_bake_job_options options = vsh_bake_job_options_default();
        options.shard = i;
        options.shard_count = SHARDS;
        options.shard_least = least;
        options.words = words;
        options.word_count = 3;
        vsh_error error;
        assert_ok(vsh_bake_scene(&c->scene, &options, NULL, NULL, &error), &error);
    }
}

static void bake_parts(const case_scene *c) {
    bake_parts_of(c, 0.0);
}

static vsh_result merge(const case_scene *c, taken *t, const vsh_run *run, vsh_error *error) {
    const vsh_row_sink sink = sink_of(t);
    vsh_bake_job_options options = vsh_bake_job_options_default();
    options.sink = &sink;
    vsh_bake_job *job = NULL;
    vsh_result result = vsh_bake_job_create(&c->scene, &options, run, &job, error);
    result = result == VSH_OK ? vsh_bake_job_merge(job, run, error) : result;
    vsh_bake_job_free(job);
    return result;
}

static void a_sink_takes_merged_rows_as_of_one_bake_and_words_come_back(void **state) {
    (void)state;
    case_scene c;
    fill(&c, SIZE, 0.4);
    taken *one = calloc(2, sizeof *one), *all = one + 1;
    assert_non_null(one);
    const vsh_row_sink sink = sink_of(one);
    vsh_bake_job_options options = vsh_bake_job_options_default();
    options.sink = &sink;
    vsh_error error;
    vsh_bake_report report;
    assert_ok(vsh_bake_scene(&c.scene, &options, NULL, &report, &error), &error);
    assert_true(report.invalid_texels > 20 && report.invalid_texels < SIZE * SIZE / 2);
    bake_parts(&c);
    assert_ok(merge(&c, all, NULL, &error), &error);
    assert_int_equal(all->rows, SIZE);
    assert_int_equal(all->channels, 6);
    assert_memory_equal(one->values, all->values, sizeof one->values);
    char **words;
    size_t count;
    assert_ok(vsh_part_words(c.output, 0, NULL, &words, &count, &error), &error);
    assert_int_equal(count, 3);
    assert_string_equal(words[0], "one");
    assert_string_equal(words[1], "");
    assert_string_equal(words[2], "three words");
    assert_null(words[3]);
    vsh_part_words_free(words);
    free(one);
}

/* The ball becomes a wall that stands on the floor, to which rays of AO go that texels share. `made`: with
 * all that is made of AO. */
static void fill_traced(case_scene *c, char wall[300], bool made) {
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

static void what_parts_leave_of_ao_is_as_of_one_bake(void **state) {
    (void)state;
    case_scene c;
    char wall[300];
    if (!vsh_triangles_available()) {
        return;
    }
    for (int32_t made = 0; made < 3; ++made) {
        fill_traced(&c, wall, made > 0);
        c.scene.has_ambient = made == 2;
        c.scene.ambient[0] = 0.25;
        c.scene.ambient[2] = 0.75;
        taken *one = calloc(2, sizeof *one), *all = one + 1;
        assert_non_null(one);
        const vsh_row_sink sink = sink_of(one);
        vsh_bake_job_options options = vsh_bake_job_options_default();
        options.sink = &sink;
        vsh_error error;
        assert_ok(vsh_bake_scene(&c.scene, &options, NULL, NULL, &error), &error);
        bake_parts(&c);
        assert_ok(merge(&c, all, NULL, &error), &error);
        assert_int_equal(all->channels, made > 0 ? CHANNELS : 5);
        assert_memory_equal(one, all, sizeof *one);
        free(one);
    }
}

static void a_shard_without_rows_reads_nothing_and_its_part_is_merged(void **state) {
    (void)state;
    case_scene c;
    char wall[300];
    fill_traced(&c, wall, false);
    taken *one = calloc(2, sizeof *one), *all = one + 1;
    assert_non_null(one);
    bake_parts(&c);
    vsh_error error;
    assert_ok(merge(&c, one, NULL, &error), &error);
    bake_parts_of(&c, vsh_bake_job_options_default().shard_least);
    assert_ok(merge(&c, all, NULL, &error), &error);
    assert_memory_equal(one, all, sizeof *one);
    free(one);

    vsh_bake_job_options options = vsh_bake_job_options_default();
    options.shard = options.shard_count = SHARDS;
    options.parts = at("alone");
    assert_int_equal(remove(wall), 0);
    for (int idle = 0; idle < 2; ++idle) {
        options.shard_least = idle ? 1e-3 : 0.0; /* 48 × 48 texels take some milliseconds */
        vsh_bake_job *job = NULL;
        c.receiver.width = c.receiver.height = idle ? 8 : SIZE;
        const vsh_result result = vsh_bake_job_create(&c.scene, &options, NULL, &job, &error);
        assert_int_equal(result, idle ? VSH_OK : VSH_ERROR_READ);
        if (idle) {
            assert_int_equal(vsh_bake_job_count(job), 0);
            assert_int_equal(vsh_bake_job_run(job, NULL, &error), VSH_ERROR_ARGUMENT); /* not prepared */
            assert_ok(vsh_bake_job_measure(job, NULL, &error), &error);
            assert_ok(vsh_bake_job_prepare(job, NULL, &error), &error);
            assert_ok(vsh_bake_job_run(job, NULL, &error), &error);
        }
        vsh_bake_job_free(job);
    }
}

static size_t lightmaps_of_second(const case_scene *c, double least) {
    vsh_bake_job_options options = vsh_bake_job_options_default();
    options.shard = options.shard_count = SHARDS;
    options.shard_least = least;
    vsh_bake_job *job = NULL;
    vsh_error error;
    assert_ok(vsh_bake_job_create(&c->scene, &options, NULL, &job, &error), &error);
    const size_t count = vsh_bake_job_count(job);
    assert_int_equal(vsh_bake_job_shards(&c->scene, &options), count == 0 ? 1 : SHARDS);
    vsh_bake_job_free(job);
    return count;
}

static void what_is_marched_is_more_work_and_objects_of_their_own_are_not_known(void **state) {
    (void)state;
    case_scene c;
    char wall[300];
    fill_traced(&c, wall, false);
    assert_int_equal(lightmaps_of_second(&c, 0.02), 0);
    assert_int_equal(vsh_bake_job_shards(&c.scene, NULL), 0);
    c.scene.shade.max_error = 1e-3;
    assert_int_equal(lightmaps_of_second(&c, 0.02), 1);
    c.scene.shade.max_error = 0.02;
    c.receiver.atlas = VSH_ATLAS_OBJECTS;
    assert_int_equal(lightmaps_of_second(&c, 0.02), 1);
    fill(&c, SIZE, 0.4);
    assert_int_equal(lightmaps_of_second(&c, 0.02), 1);
}

static void shards_that_are_told_otherwise_how_many_have_rows_are_refused(void **state) {
    (void)state;
    case_scene c;
    fill(&c, SIZE, 0.4);
    taken t;
    vsh_error error;
    for (int32_t idle = 0; idle < 2; ++idle) {
        bake_parts_of(&c, idle ? 0.0 : 1.0);
        vsh_bake_job_options options = vsh_bake_job_options_default();
        options.shard = options.shard_count = SHARDS;
        options.shard_least = idle ? 1.0 : 0.0;
        assert_ok(vsh_bake_scene(&c.scene, &options, NULL, NULL, &error), &error);
        assert_int_equal(merge(&c, &t, NULL, &error), VSH_ERROR_INPUT);
        assert_non_null(strstr(error.message, "floor.exr.2-of-2.part: is of other inputs or options"));
    }
}

static void a_job_of_a_part_is_refused_what_it_cannot_do(void **state) {
    (void)state;
    case_scene c;
    fill(&c, SIZE, 0.4);
    taken t;
    const vsh_row_sink sink = sink_of(&t);
    static const int32_t wrong[][2] = {{1, 0}, {2, 1}, {-1, 3}, {1, 10001}, {1, -1}};
    static const double times[] = {-1.0, 2e9, NAN, INFINITY};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0] + 6; ++i) {
        vsh_bake_job_options options = vsh_bake_job_options_default();
        options.shard = i < 5 ? wrong[i][0] : 1;
        options.shard_count = i < 5 ? wrong[i][1] : 2;
        options.sink = i == 5 ? &sink : NULL;
        options.word_count = i == 6;
        options.shard_least = i > 6 ? times[i - 7] : options.shard_least;
        vsh_bake_job *job = NULL;
        vsh_error error;
        assert_int_equal(vsh_bake_job_create(&c.scene, &options, NULL, &job, &error), VSH_ERROR_ARGUMENT);
        assert_null(job);
    }
}

/* --- files of strangers */

typedef struct bytes {
    unsigned char *at;
    size_t size;
} bytes;

static bytes read_file(const char *path) {
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    bytes b = {.size = (size_t)ftell(file)};
    rewind(file);
    b.at = malloc(b.size);
    assert_non_null(b.at);
    assert_int_equal(fread(b.at, 1, b.size, file), b.size);
    fclose(file);
    return b;
}

/* With a checksum that is right. */
static void write_file(const char *path, const bytes *b) {
    const size_t body = b->size - sizeof(uint64_t);
    const uint64_t sum = vshi_part_sum(VSHI_PART_SUM, b->at, body);
    memcpy(b->at + body, &sum, sizeof sum);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(b->at, 1, b->size, file), b->size);
    assert_int_equal(fclose(file), 0);
}

typedef vsh_result merge_fn(void *user, vsh_error *error);

/* Changes every byte of the head, of the tail, and some of what lies between, to what is worst for a number
 * of it. What is refused is refused by the part's name. */
static void try_all(const char *path, merge_fn *merge_it, void *user) {
    static const unsigned char worst[] = {0x00, 0x01, 0x7f, 0x80, 0xff};
    const bytes good = read_file(path);
    bytes bad = {malloc(good.size), good.size};
    assert_non_null(bad.at);
    vshi_part_front front;
    memcpy(&front, good.at, sizeof front);
    const size_t head = sizeof front + (size_t)front.head_bytes;
    const size_t tail = good.size - sizeof(uint64_t) - (size_t)front.tail_bytes;
    size_t refused = 0, taken_all_the_same = 0;
    for (size_t at = 0; at < good.size - sizeof(uint64_t); at += at < head
                                                                     ? 1 + (at > sizeof front ? at % 3 : 0)
                                                                 : at < tail ? (tail - head) / 30 + 1
                                                                             : 5) {
        memcpy(bad.at, good.at, good.size);
        bad.at[at] = worst[at % sizeof worst] != good.at[at] ? worst[at % sizeof worst] : 0xaa;
        write_file(path, &bad);
        vsh_error error = {VSH_OK, ""};
        const vsh_result result = merge_it(user, &error);
        if (result == VSH_OK) {
            ++taken_all_the_same; /* a value, a count, a text of nobody's */
        } else if ((result != VSH_ERROR_INPUT && result != VSH_ERROR_READ && result != VSH_ERROR_LIMIT) ||
                   strstr(error.message, strrchr(path, '/') + 1) == NULL) {
            fail_msg("byte %zu: %s '%s'", at, vsh_result_name(result), error.message);
        } else {
            ++refused;
        }
    }
    assert_true(refused > 100 && taken_all_the_same > 10);
    memcpy(bad.at, good.at, good.size);
    write_file(path, &bad);
    vsh_error error;
    assert_ok(merge_it(user, &error), &error);
    free(bad.at);
    free(good.at);
}

typedef struct bake_case {
    case_scene *scene;
    taken *rows;
    vsh_run run;
} bake_case;

static vsh_result merge_bake(void *user, vsh_error *error) {
    const bake_case *c = user;
    return merge(c->scene, c->rows, &c->run, error);
}

static void no_part_of_a_lightmap_does_worse_than_fail(void **state) {
    (void)state;
    case_scene c;
    fill(&c, SIZE, 0.4);
    bake_parts(&c);
    bake_case one = {&c, calloc(1, sizeof(taken)), vsh_run_default()};
    assert_non_null(one.rows);
    one.run.memory_limit = 64 << 20;
    one.run.threads = 1;
    try_all(at("floor.exr.2-of-2.part"), merge_bake, &one);
    free(one.rows);
}

static void no_part_that_leaves_ao_does_worse_than_fail(void **state) {
    (void)state;
    case_scene c;
    char wall[300];
    if (!vsh_triangles_available()) {
        return;
    }
    fill_traced(&c, wall, true);
    bake_parts(&c);
    bake_case one = {&c, calloc(1, sizeof(taken)), vsh_run_default()};
    assert_non_null(one.rows);
    one.run.memory_limit = 64 << 20;
    one.run.threads = 1;
    try_all(at("floor.exr.2-of-2.part"), merge_bake, &one);
    free(one.rows);
}

/* Sky for AO, of as many bytes: what is kept is not what these channels are finished by. */
static void kinds_of_other_channels_are_refused(void **state) {
    (void)state;
    case_scene c;
    char wall[300];
    if (!vsh_triangles_available()) {
        return;
    }
    fill_traced(&c, wall, false);
    bake_parts(&c);
    const char *path = at("floor.exr.2-of-2.part");
    const bytes good = read_file(path);
    vshi_part_front front;
    memcpy(&front, good.at, sizeof front);
    taken *rows = calloc(1, sizeof *rows);
    assert_non_null(rows);
    size_t refused = 0;
    for (size_t i = sizeof front; i < sizeof front + (size_t)front.head_bytes; ++i) {
        if (good.at[i] != 1) {
            continue;
        }
        vsh_error error = {VSH_OK, ""};
        good.at[i] = 2;
        write_file(path, &good);
        good.at[i] = 1;
        merge(&c, rows, NULL, &error);
        refused += strstr(error.message, "2-of-2.part: damaged: rays of AO of other channels") != NULL;
    }
    assert_int_equal(refused, 1);
    free(rows);
    free(good.at);
}

typedef struct volume_case {
    vsh_voxels *voxels;
    vsh_light sun;
    vsh_volume_options options;
    vsh_part_options parts;
    vsh_run run;
} volume_case;

static vsh_result merge_volume(void *user, vsh_error *error) {
    const volume_case *c = user;
    vsh_volume *volume = NULL;
    const vsh_result result =
        vsh_volume_merge(c->voxels, &c->sun, 1, &c->options, &c->parts, &c->run, &volume, NULL, error);
    vsh_volume_free(volume);
    return result;
}

static void no_part_of_a_volume_does_worse_than_fail(void **state) {
    (void)state;
    vsh_sdf_node ball = vsh_sdf_node_default();
    ball.radius = 0.5;
    const vsh_sdf sdf = {&ball, 1};
    static const double low[3] = {-1, -1, -1}, high[3] = {1, 1, 1};
    static const vsh_attribute attribute = {"of", "a ball"};
    char name[300];
    snprintf(name, sizeof name, "%s", at("ball.vdb"));
    vsh_grid_options resolution = vsh_grid_options_default();
    resolution.resolution = 16;
    vsh_error error;
    vsh_grid *grid = NULL;
    vsh_occluders *occluders = NULL;
    volume_case c = {.sun = vsh_light_default(),
                     .options = vsh_volume_options_default(),
                     .parts = vsh_part_options_default(),
                     .run = vsh_run_default()};
    c.run.memory_limit = 64 << 20;
    c.run.threads = 1;
    assert_ok(vsh_grid_from_sdf(&sdf, &resolution, NULL, &grid, &error), &error);
    assert_ok(vsh_occluders_from_grid(grid, NULL, NULL, &occluders, &error), &error);
    assert_ok(vsh_voxels_from_box(low, high, 0.1, NULL, &c.voxels, &error), &error);
    c.parts.parts = name;
    c.parts.shard_count = SHARDS;
    c.parts.attributes = &attribute;
    c.parts.attribute_count = 1;
    for (c.parts.shard = 1; c.parts.shard <= SHARDS; ++c.parts.shard) {
        assert_ok(
            vsh_bake_volume_part(occluders, c.voxels, &c.sun, 1, &c.options, &c.parts, NULL, NULL, &error),
            &error);
    }
    try_all(at("ball.vdb.2-of-2.part"), merge_volume, &c);
    vsh_occluders_info casters;
    assert_ok(vsh_volume_part_casters(name, 0, NULL, &casters, &error), &error);
    assert_true(casters.voxel_size > 0.0);
    vsh_voxels_free(c.voxels);
    vsh_occluders_free(occluders);
    vsh_grid_free(grid);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_sink_takes_merged_rows_as_of_one_bake_and_words_come_back),
        cmocka_unit_test(what_parts_leave_of_ao_is_as_of_one_bake),
        cmocka_unit_test(a_shard_without_rows_reads_nothing_and_its_part_is_merged),
        cmocka_unit_test(what_is_marched_is_more_work_and_objects_of_their_own_are_not_known),
        cmocka_unit_test(shards_that_are_told_otherwise_how_many_have_rows_are_refused),
        cmocka_unit_test(a_job_of_a_part_is_refused_what_it_cannot_do),
        cmocka_unit_test(no_part_of_a_lightmap_does_worse_than_fail),
        cmocka_unit_test(no_part_that_leaves_ao_does_worse_than_fail),
        cmocka_unit_test(kinds_of_other_channels_are_refused),
        cmocka_unit_test(no_part_of_a_volume_does_worse_than_fail),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
