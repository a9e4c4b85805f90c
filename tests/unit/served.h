/* Models as a reader's process tells them, for tests that are their own reader (vsh_run.reader), and tellings
 * in which a word is wrong. */
#pragma once

#include "testing.h"

#include "models.h"

#include "io/model/model.h"

#include <sys/mman.h>

/* A glTF, read here or by a reader; its warnings are kept. */
static inline vsh_model *read_gltf_by(bool reader, const char *json) {
    vsh_run run = vsh_run_default();
    run.warning = keep_warning;
    run.notes = 1;
    run.reader = reader ? "/proc/self/exe" : NULL;
    run.reader_seconds = reader ? 120.0 : 0.0;
    warnings[0] = '\0';
    vsh_model *model = NULL;
    write_bytes("a.gltf", json, strlen(json));
    assert_ok(vsh_model_read(path_of("a.gltf").text, &run, &model, &failure));
    assert_int_equal(unlink(path_of("a.gltf").text), 0);
    return model;
}

/* Writes a reader's answer for a file. Returns its number of bytes. */
static inline size_t payload_of(const char *name, unsigned char *bytes, size_t room) {
    static vshi_encoder encoder;
    vsh_error error = {0};
    const vsh_run run = vsh_run_default();
    const int file = memfd_create("payload", 0);
    vshi_encoder_begin(&encoder, file, 0);
    assert_int_equal(vshi_serve_model(path_of(name).text, NULL, &run, &encoder, &error), VSH_OK);
    assert_true(vshi_encoder_flush(&encoder));
    assert_in_range(encoder.size, 8, room);
    assert_int_equal(pread(file, bytes, (size_t)encoder.size, 0), (ssize_t)encoder.size);
    close(file);
    return (size_t)encoder.size;
}

/* The model of a telling, within a memory limit. */
static inline vsh_result decode(const unsigned char *bytes, size_t size, const char *name, uint64_t limit,
                                vsh_model **model, vsh_error *error) {
    vshi_decoder decoder = {bytes, bytes + size, false};
    vsh_run run = run_within(limit);
    return vshi_model_decode(&decoder, path_of(name).text, &run, model, error);
}

/* Small counts and numbers of arrays, doubles that are none or out of range, and two letters of a path. */
enum { WRONG_WORDS = 13 };
static const uint64_t wrong_words[WRONG_WORDS] = {0,
                                                  1,
                                                  2,
                                                  3,
                                                  9,
                                                  64,
                                                  UINT64_MAX,
                                                  UINT64_C(0x7ff) << 52,
                                                  UINT64_C(0xbff) << 52,
                                                  UINT64_C(0x3ff) << 52,
                                                  UINT64_C(0x7ff8) << 48,
                                                  UINT64_C(0x7fe) << 52,
                                                  UINT64_C(0x6374652f2e2e2f2e)};

/* Each word of a file's telling in turn wrong, or perhaps: refused in a line that names the file, or a model
 * for `look`. So many refused and sound ones are expected at least. */
static inline void tell_wrong(const char *name, const uint64_t *values, size_t value_count,
                              void (*look)(const vsh_model *), int refused_least, int sound_least) {
    static _Alignas(8) unsigned char whole[4096], bytes[4096];
    const size_t size = payload_of(name, whole, sizeof whole);
    int refused_count = 0, sound_count = 0;
    for (size_t word = 0; word < size / 8; ++word) {
        for (size_t k = 0; k < value_count; ++k) {
            vsh_model *model = NULL;
            vsh_error error = {0};
            memcpy(bytes, whole, size);
            memcpy(bytes + 8 * word, &values[k], 8);
            if (decode(bytes, size, name, 0, &model, &error) != VSH_OK) {
                assert_that(strstr(error.message, name) != NULL, "word %zu: %s", word, error.message);
                ++refused_count;
                continue;
            }
            look(model);
            vsh_model_free(model);
            ++sound_count;
        }
    }
    assert_in_range(refused_count, refused_least, 100000);
    assert_in_range(sound_count, sound_least, 100000);
}
