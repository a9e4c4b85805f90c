/* Parts of strangers: no file makes merging do worse than fail. */
#include "bake_scene/parts.h"
#include "expect.h"
#include "parts.h"

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

typedef struct bake_case {
    case_scene *scene;
    taken *rows;
    vsh_run run;
} bake_case;

static vsh_result merge_bake(const bake_case *c, vsh_error *error) {
    return merge(c->scene, c->rows, &c->run, error);
}

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
        const vsh_result result = merge_bake(one, &failure);
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
    expect_ok(merge_bake(one, &failure));
    free(bad.at);
    free(good.at);
}

static void try_all_of(case_scene *c) {
    bake_parts(c);
    bake_case one = {c, calloc(1, sizeof(taken)), vsh_run_default()};
    assert_non_null(one.rows);
    one.run.memory_limit = 64 << 20;
    one.run.threads = 1;
    try_all(at("floor.exr.2-of-2.part"), &one, 100);
    free(one.rows);
}

static void no_part_of_a_lightmap_does_worse_than_fail(void **state) {
    case_scene c;
    fill(&c, SIZE, 0.4);
    try_all_of(&c);
}

static void no_part_that_leaves_ao_does_worse_than_fail(void **state) {
    case_scene c;
    char wall[300];
    if (!vsh_triangles_available()) {
        return;
    }
    fill_traced(&c, wall, true);
    try_all_of(&c);
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
        const vsh_result result = merge_bake(one, &failure);
        char expected[64];
        snprintf(expected, sizeof expected, "is %g, out of range", (double)value);
        if (result == VSH_ERROR_INPUT && strstr(failure.message, expected) != NULL) {
            assert_non_null(strstr(failure.message, strrchr(path, '/') + 1));
            assert_non_null(strstr(failure.message, place));
            ++refused;
        }
        free(bad.at);
    }
    print_message("%zu of %zu tries were refused by range\n", refused, words / step);
    assert_true(refused >= words / step / 20);
    write_file(path, &good);
    free(good.at);
}

static void values_out_of_range_are_refused_by_part_plane_and_texel(void **state) {
    case_scene c;
    fill(&c, SIZE, 0.4);
    bake_parts(&c);
    bake_case one = {&c, calloc(1, sizeof(taken)), vsh_run_default()};
    assert_non_null(one.rows);
    try_values(at("floor.exr.2-of-2.part"), "of texel (", &one);
    free(one.rows);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_part_of_a_lightmap_does_worse_than_fail),
        cmocka_unit_test(no_part_that_leaves_ao_does_worse_than_fail),
        cmocka_unit_test(values_out_of_range_are_refused_by_part_plane_and_texel),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
