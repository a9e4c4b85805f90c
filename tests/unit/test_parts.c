/* Parts of lightmaps, by the library: merged rows, refused options, and damaged parts. */
#include "floor_under_ball.h"
#include "scene/bake_scene.h"
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

/* The ball becomes a wall that stands on the floor. Texels share rays of AO, from which all channels are
 * made. */
static void fill_traced(case_scene *c, char wall[300]) {
    fill(c, SIZE, 0.4);
    snprintf(wall, 300, "%s", at("wall.obj"));
    static const char text[] = "v -2 -1 0\nv 1 -1 0\nv 1 1 0.5\nv -2 1 0.5\nf 1 2 3\nf 1 3 4\n";
    write_all(wall, (const unsigned char *)text, sizeof text - 1);
    c->caster.type = VSH_CASTER_MESH;
    c->caster.path = wall;
    c->caster.transform[7] = 0.0;
    c->receiver.ao_spacing = 2;
    c->scene.irradiance = true;
    c->scene.bent = VSH_BENT_TANGENT;
    c->scene.planes.sky = VSH_UP_Y;
    c->scene.error = 1;
    c->scene.shade.method = VSH_SHADOW_EXACT;
    c->scene.shade.ao_method = VSH_AO_EXACT;
}

TEST(merged_parts_have_the_rows_of_one_bake_and_keep_words) {
    case_scene c;
    fill(&c, SIZE, 0.4);
    static taken one, all;
    vsh_bake_report report = {.errors = NULL};
    const vsh_bake_options options = options_of(&one);
    assert_ok(vsh_bake_scene(&c.scene, &options, NULL, &report, &failure));
    assert_true(report.invalid_texels > 20 && report.invalid_texels < SIZE * SIZE / 2);
    bake_parts(&c);
    assert_ok(merge(&c, &all, NULL));
    assert_int_equal(all.rows, SIZE);
    assert_int_equal(all.channels, 6);
    assert_memory_equal(one.values, all.values, sizeof one.values);
    char **words;
    size_t count;
    assert_ok(vsh_part_words(c.output, 0, NULL, &words, &count, &failure));
    assert_int_equal(count, 3);
    assert_string_equal(words[0], "one");
    assert_string_equal(words[1], "");
    assert_string_equal(words[2], "three words");
    assert_null(words[3]);
    vsh_part_words_free(words);
}

TEST(options_that_a_part_cannot_have_are_refused) {
    case_scene c;
    fill(&c, SIZE, 0.4);
    taken t;
    static const int32_t wrong[][2] = {{1, 0}, {2, 1}, {-1, 3}, {1, 10001}, {1, -1}};
    for (size_t i = 0; i < COUNT_OF(wrong) + 2; ++i) {
        vsh_bake_options options = i == 5 ? options_of(&t) : vsh_bake_options_default();
        options.shard = i < 5 ? wrong[i][0] : 1;
        options.shard_count = i < 5 ? wrong[i][1] : 2;
        options.word_count = i == 6;
        assert_fails(vsh_bake_scene(&c.scene, &options, NULL, NULL, &failure), VSH_ERROR_ARGUMENT, "");
    }
}

/* --- parts of strangers */

static taken rows;

/* Writes a part with a checksum that is right. */
static void write_part(const char *path, unsigned char *part, size_t size) {
    const size_t body = size - sizeof(uint64_t);
    const uint64_t sum = vshi_part_sum(VSHI_PART_SUM, part, body);
    memcpy(part + body, &sum, sizeof sum);
    write_all(path, part, size);
}

/* Changes every byte of the front, many of the head and of the first tile's numbers, and a few others to the
 * worst values. A refusal names the part. */
static void damage_bytes(const char *path, const case_scene *scene, const vsh_run *run) {
    static const unsigned char worst[] = {0x00, 0x01, 0x7f, 0x80, 0xff};
    FREED unsigned char *good = NULL;
    const size_t size = read_all(path, &good);
    FREED unsigned char *bad = malloc(size);
    vshi_part_front front;
    memcpy(&front, good, sizeof front);
    const size_t head = sizeof front + (size_t)front.head_bytes;
    const size_t numbers = head + sizeof(vsh_shade_stats);
    const size_t end = size - sizeof(uint64_t), step = (end - numbers) / 150 + 1;
    size_t refused = 0, merged = 0;
    for (size_t at = 0; at < end; at += at < sizeof front ? 1 : at < numbers ? 1 + at % 3 : step) {
        memcpy(bad, good, size);
        bad[at] = worst[at % sizeof worst] != good[at] ? worst[at % sizeof worst] : 0xaa;
        write_part(path, bad, size);
        const vsh_result result = merge(scene, &rows, run);
        const bool is_refusal =
            result == VSH_ERROR_INPUT || result == VSH_ERROR_READ || result == VSH_ERROR_LIMIT;
        assert_that(result == VSH_OK ||
                        (is_refusal && strstr(failure.message, strrchr(path, '/') + 1) != NULL),
                    "byte %zu: %s '%s'", at, vsh_result_name(result), failure.message);
        refused += is_refusal;
        merged += result == VSH_OK; /* with another value, count or text */
    }
    assert_true(refused > 100 && merged > 10);
    write_part(path, good, size);
    assert_ok(merge(scene, &rows, run));
}

TEST(damaged_parts_are_refused_or_merged_without_a_crash) {
    vsh_run run = run_within(64 << 20);
    run.threads = 1;
    for (int traced = 0; traced < 2; ++traced) { /* which leave AO */
        case_scene c;
        char wall[300];
        if (traced) {
            fill_traced(&c, wall);
        } else {
            fill(&c, SIZE, 0.4);
        }
        bake_parts(&c);
        damage_bytes(at("floor.exr.2-of-2.part"), &c, &run);
    }
}

FIXTURE(make_folder, remove_folder)
