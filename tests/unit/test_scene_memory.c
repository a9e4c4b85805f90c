/* What reading a scene's text may take is known before it is read. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "sandbox/reader.h"

#include <vdbshade/flat.h>
#include <vdbshade/scene.h>

#include <jansson.h>
#include <malloc.h>
#include <stdbool.h>
#include <unistd.h>

/* A folder of this run's own: the sanitizers' build runs beside this one in the same working folder. */
static char folder[] = "/tmp/vdbshade-scene-memory-XXXXXX";
static char file[sizeof folder + sizeof "/memory.json"];

/* A text of `count` times a piece, between two others; in a file of ours. Its length, without the NUL. */
static size_t write_scene(const char *head, const char *piece, size_t count, const char *tail, char **text) {
    const size_t length = strlen(head) + count * strlen(piece) + strlen(tail);
    *text = malloc(length + 1);
    assert_non_null(*text);
    char *at = stpcpy(*text, head);
    for (size_t i = 0; i < count; ++i) {
        at = stpcpy(at, piece);
    }
    stpcpy(at, tail);
    FILE *out = fopen(file, "wb");
    assert_non_null(out);
    assert_int_equal(fwrite(*text, 1, length, out), length);
    assert_int_equal(fclose(out), 0);
    return length;
}

static size_t taken(void) {
    const struct mallinfo2 all = mallinfo2();
    return all.uordblks + all.hblkhd;
}

static bool passes(size_t limit) {
    vsh_run run = vsh_run_default();
    run.memory_limit = limit;
    vsh_scene *scene = NULL;
    vsh_error error = {VSH_OK, ""};
    const vsh_result result = vsh_scene_read(file, &run, &scene, &error);
    vsh_scene_free(scene);
    vsh_flat_scene *flat = NULL;
    assert_true((vsh_flat_scene_read(file, &run, &flat, NULL) == VSH_ERROR_LIMIT) ==
                (result == VSH_ERROR_LIMIT));
    vsh_flat_scene_free(flat);
    assert_true(result != VSH_ERROR_LIMIT || strstr(error.message, "memory.json") != NULL);
    return result != VSH_ERROR_LIMIT;
}

static size_t least_limit(void) {
    size_t low = 1, high = (size_t)1 << 32;
    assert_true(passes(high) && !passes(low));
    while (high - low > low / 32 + 1) {
        const size_t middle = low + (high - low) / 2;
        *(passes(middle) ? &high : &low) = middle;
    }
    return high;
}

static void every_text_takes_less_than_the_least_limit_that_lets_it_pass(void **unused) {
    (void)unused;
    if (VSHI_SANITIZED) {
        skip(); /* whose allocator takes more, and does not tell */
    }
    static const struct {
        const char *head, *piece, *tail;
    } texts[] = {{"[{}", ",{}", "]"},
                 {"[[]", ",[]", "]"},
                 {"[1", ",1", "]"},
                 {"[\"\"", ",\"\"", "]"},
                 {"[\"\"", ",\"{[,:\\\"\"", "]"},
                 {"[{\"a\":0}", ",{\"a\":0}", "]"},
                 {"[{\"a\":{}}", ",{\"a\":[]}", "]"},
                 {"[{\"a\":1,\"b\":2,\"c\":3,\"d\":4,\"e\":5,\"f\":6,\"g\":7,\"h\":8,\"i\":9}",
                  ",{\"a\":1,\"b\":2,\"c\":3,\"d\":4,\"e\":5,\"f\":6,\"g\":7,\"h\":8,\"i\":9}", "]"},
                 {"[[1,2,3]", ",[1,2,3]", "]"},
                 {"[[1,2,3,4,5,6,7,8,9]", ",[1,2,3,4,5,6,7,8,9]", "]"}};
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; ++i) {
        for (size_t count = 900; count <= 9000; count *= 3) {
            char *text;
            const size_t length = write_scene(texts[i].head, texts[i].piece, count, texts[i].tail, &text);
            const size_t before = taken();
            json_t *tree = json_loadb(text, length, 0, NULL);
            assert_non_null(tree);
            const size_t takes = taken() - before + length;
            json_decref(tree);
            const size_t limit = least_limit();
            if (!(takes <= limit && limit <= 8 * takes)) {
                fail_msg("%zu times %s: takes %zu, passes at %zu", count, texts[i].piece, takes, limit);
            }
            free(text);
        }
    }
}

static void a_bomb_is_refused_before_it_is_read(void **unused) {
    (void)unused;
    char *text;
    write_scene("[{}", ",{}", 300000, "]", &text);
    free(text);
    const size_t before = taken();
    assert_false(passes((size_t)50 << 20));
    assert_true(taken() <= before + 65536);
}

static int make_folder(void **state) {
    (void)state;
    if (mkdtemp(folder) == NULL) {
        return -1;
    }
    snprintf(file, sizeof file, "%s/memory.json", folder);
    return 0;
}

static int remove_folder(void **state) {
    (void)state;
    unlink(file);
    return rmdir(folder);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_text_takes_less_than_the_least_limit_that_lets_it_pass),
        cmocka_unit_test(a_bomb_is_refused_before_it_is_read),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
