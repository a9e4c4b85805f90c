/* Parts of lightmaps, by the library: what merging takes, which parts have rows, and that no file makes
 * merging do worse than fail. */
#include "bake_scene/parts.h"
#include "floor_under_ball.h"
#include "testing.h"

enum { SIZE = 80, SHARDS = 2, CHANNELS = 12 };

/* Rows as they come. */
typedef struct taken {
    float values[CHANNELS][SIZE * SIZE];
    int32_t rows, channels;
} taken;

static vsh_result add_rows(void *user, const vsh_scene_lightmap *lightmap, const vsh_image *image,
                           int32_t first, int32_t count, const float *const *planes, vsh_error *error) {
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

static vsh_bake_options options_of(taken *t) {
    vsh_bake_options options = vsh_bake_options_default();
    options.rows = add_rows;
    options.user = t;
    return options;
}

static void bake_parts(const case_scene *c) {
    static const char *const words[] = {"one", "", "three words"};
    for (int32_t i = 1; i <= SHARDS; ++i) {
        vsh_bake_options options = vsh_bake_options_default();
        options.shard = i;
        options.shard_count = SHARDS;
        options.words = words;
        options.word_count = 3;
        assert_ok(vsh_bake_scene(&c->scene, &options, NULL, NULL, &failure));
    }
}

static vsh_result merge(const case_scene *c, taken *t, const vsh_run *run) {
    const vsh_bake_options options = options_of(t);
    return vsh_merge_scene(&c->scene, &options, run, NULL, &failure);
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

static void bake_whole(const case_scene *c, taken *rows, vsh_bake_report *report) {
    const vsh_bake_options options = options_of(rows);
    assert_ok(vsh_bake_scene(&c->scene, &options, NULL, report, &failure));
}

TEST(merged_rows_are_those_of_one_bake_and_words_come_back) {
    case_scene c;
    fill(&c, SIZE, 0.4);
    taken *one = calloc(2, sizeof *one), *all = one + 1;
    assert_non_null(one);
    vsh_bake_report report = {.errors = NULL};
    bake_whole(&c, one, &report);
    assert_true(report.invalid_texels > 20 && report.invalid_texels < SIZE * SIZE / 2);
    bake_parts(&c);
    assert_ok(merge(&c, all, NULL));
    assert_int_equal(all->rows, SIZE);
    assert_int_equal(all->channels, 6);
    assert_memory_equal(one->values, all->values, sizeof one->values);
    char **words;
    size_t count;
    assert_ok(vsh_part_words(c.output, 0, NULL, &words, &count, &failure));
    assert_int_equal(count, 3);
    assert_string_equal(words[0], "one");
    assert_string_equal(words[1], "");
    assert_string_equal(words[2], "three words");
    assert_null(words[3]);
    vsh_part_words_free(words);
    free(one);
}

TEST(what_parts_leave_of_ao_is_as_of_one_bake) {
    case_scene c;
    char wall[300];
    for (int32_t made = 0; made < 3; ++made) {
        fill_traced(&c, wall, made > 0);
        c.scene.has_ambient = made == 2;
        c.scene.ambient[0] = 0.25;
        c.scene.ambient[2] = 0.75;
        taken *one = calloc(2, sizeof *one), *all = one + 1;
        assert_non_null(one);
        bake_whole(&c, one, NULL);
        bake_parts(&c);
        assert_ok(merge(&c, all, NULL));
        assert_int_equal(all->channels, made > 0 ? CHANNELS : 5);
        assert_memory_equal(one, all, sizeof *one);
        free(one);
    }
}

TEST(options_that_a_part_cannot_have_are_refused) {
    case_scene c;
    fill(&c, SIZE, 0.4);
    taken t;
    static const int32_t wrong[][2] = {{1, 0}, {2, 1}, {-1, 3}, {1, 10001}, {1, -1}};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0] + 2; ++i) {
        vsh_bake_options options = i == 5 ? options_of(&t) : vsh_bake_options_default();
        options.shard = i < 5 ? wrong[i][0] : 1;
        options.shard_count = i < 5 ? wrong[i][1] : 2;
        options.word_count = i == 6;
        assert_fails(vsh_bake_scene(&c.scene, &options, NULL, NULL, &failure), VSH_ERROR_ARGUMENT, "");
    }
}

/* --- parts of strangers */

typedef struct bytes {
    unsigned char *at;
    size_t size;
} bytes;

static bytes read_file(const char *path) {
    bytes b;
    b.size = read_all(path, &b.at);
    return b;
}

/* With a checksum that is right. */
static void write_file(const char *path, const bytes *b) {
    const size_t body = b->size - sizeof(uint64_t);
    const uint64_t sum = vshi_part_sum(VSHI_PART_SUM, b->at, body);
    memcpy(b->at + body, &sum, sizeof sum);
    write_all(path, b->at, b->size);
}

typedef struct bake_case {
    case_scene *scene;
    taken *rows;
    vsh_run run;
} bake_case;

/* Changes every byte of the front, many of the head and of the first tile's numbers, and a few others to the
 * worst values. A refusal names the part. More than `least_refused` changes are refused. */
static void try_all(const char *path, bake_case *one, size_t least_refused) {
    static const unsigned char worst[] = {0x00, 0x01, 0x7f, 0x80, 0xff};
    const bytes good = read_file(path);
    bytes bad = {malloc(good.size), good.size};
    assert_non_null(bad.at);
    vshi_part_front front;
    memcpy(&front, good.at, sizeof front);
    const size_t head = sizeof front + (size_t)front.head_bytes;
    const size_t numbers = head + sizeof(vshi_part_tile) + sizeof(vsh_shade_stats);
    const size_t end = good.size - sizeof(uint64_t), step = (end - numbers) / 150 + 1;
    size_t refused = 0, taken_all_the_same = 0;
    for (size_t at = 0; at < end; at += at < sizeof front ? 1 : at < numbers ? 1 + at % 3 : step) {
        memcpy(bad.at, good.at, good.size);
        bad.at[at] = worst[at % sizeof worst] != good.at[at] ? worst[at % sizeof worst] : 0xaa;
        write_file(path, &bad);
        const vsh_result result = merge(one->scene, one->rows, &one->run);
        if (result == VSH_OK) {
            ++taken_all_the_same; /* a value, a count, a text of nobody's */
        } else if ((result != VSH_ERROR_INPUT && result != VSH_ERROR_READ && result != VSH_ERROR_LIMIT) ||
                   strstr(failure.message, strrchr(path, '/') + 1) == NULL) {
            fail_msg("byte %zu: %s '%s'", at, vsh_result_name(result), failure.message);
        } else {
            ++refused;
        }
    }
    assert_true(refused > least_refused && taken_all_the_same > 10);
    memcpy(bad.at, good.at, good.size);
    write_file(path, &bad);
    assert_ok(merge(one->scene, one->rows, &one->run));
    free(bad.at);
    free(good.at);
}

TEST(no_part_does_worse_than_fail) {
    for (int traced = 0; traced < 2; ++traced) { /* which leave AO */
        case_scene c;
        char wall[300];
        if (traced) {
            fill_traced(&c, wall, true);
        } else {
            fill(&c, SIZE, 0.4);
        }
        bake_parts(&c);
        bake_case one = {&c, calloc(1, sizeof(taken)), vsh_run_default()};
        assert_non_null(one.rows);
        one.run.memory_limit = 64 << 20;
        one.run.threads = 1;
        try_all(at("floor.exr.2-of-2.part"), &one, 100);
        free(one.rows);
    }
}

/* Writes values that no bake produces all over the body, with the right checksum. */
static void try_values(const char *path, const char *place, bake_case *one) {
    static const float values[] = {NAN, INFINITY, -INFINITY, -1.0f, 2.0f};
    const bytes good = read_file(path);
    vshi_part_front front;
    memcpy(&front, good.at, sizeof front);
    const size_t body = sizeof front + (size_t)front.head_bytes;
    const size_t words = (good.size - sizeof(uint64_t) - body) / sizeof(float), step = words / 500 + 1;
    size_t refused = 0;
    for (size_t i = 0; i < words; i += step) {
        const float value = values[i / step % 5];
        bytes bad = {malloc(good.size), good.size};
        assert_non_null(bad.at);
        memcpy(bad.at, good.at, good.size);
        memcpy(bad.at + body + i * sizeof value, &value, sizeof value);
        write_file(path, &bad);
        const vsh_result result = merge(one->scene, one->rows, &one->run);
        char expected[64];
        snprintf(expected, sizeof expected, "is %g, out of range", (double)value);
        if (result == VSH_ERROR_INPUT && strstr(failure.message, expected) != NULL) {
            assert_non_null(strstr(failure.message, strrchr(path, '/') + 1));
            assert_non_null(strstr(failure.message, place));
            ++refused;
        }
        free(bad.at);
    }
    assert_true(refused >= words / step / 20);
    write_file(path, &good);
    free(good.at);
}

TEST(values_out_of_range_are_refused_by_part_plane_and_texel) {
    case_scene c;
    fill(&c, SIZE, 0.4);
    bake_parts(&c);
    bake_case one = {&c, calloc(1, sizeof(taken)), vsh_run_default()};
    assert_non_null(one.rows);
    try_values(at("floor.exr.2-of-2.part"), "of texel (", &one);
    free(one.rows);
}

FIXTURE(make_folder, remove_folder)
