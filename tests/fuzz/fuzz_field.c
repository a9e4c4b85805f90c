/* Files of fields, with their sums made those of what is there: else no input would come farther than them.
 */
#include "fuzz.h"

#include "field/stored.h"

#include <stdlib.h>
#include <string.h>
#include <vdbshade/shade.h>
#include <vdbshade/vdbshade.h>

static void forge_sums(char *bytes, size_t size) {
    vshi_stored_head head;
    memcpy(&head, bytes, sizeof head);
    const uint64_t records = (uint64_t)head.field_count * sizeof(vshi_stored_field);
    if (head.head_bytes > size || head.head_bytes < sizeof head || head.text_bytes > size) {
        return;
    }
    const uint64_t sums_at = vshi_stored_align(sizeof head + records + head.text_bytes, 8);
    for (uint64_t at = head.head_bytes, to = sums_at; at < size && to + 8 <= head.head_bytes; to += 8) {
        const uint64_t left = size - at, now = left < VSHI_STORED_CHUNK ? left : VSHI_STORED_CHUNK;
        const uint64_t sum = vshi_stored_sum(bytes + at, (size_t)now);
        memcpy(bytes + to, &sum, sizeof sum);
        at += now;
    }
    head.sum = 0;
    memcpy(bytes, &head, sizeof head);
    head.sum = vshi_stored_sum(bytes, (size_t)head.head_bytes);
    memcpy(bytes, &head, sizeof head);
}

/* Samples and shades by a field, its surface too. */
static void use(const vsh_field *field, const vsh_run *run) {
    enum { POINTS = 64 };
    vsh_field_info info;
    vsh_field_get_info(field, &info);
    double positions[3 * POINTS];
    float normals[3 * POINTS], values[POINTS];
    for (int i = 0; i < 3 * POINTS; ++i) {
        const int axis = i % 3;
        const double share = (double)((i * 37) % 64) / 63.0;
        positions[i] = info.bounds_min[axis] + share * 1.5 * (info.bounds_max[axis] - info.bounds_min[axis]);
        normals[i] = axis == 1 ? 1.0f : 0.25f;
    }
    vsh_field_sample(field, POINTS, positions, values);
    vsh_occluder_parts parts = vsh_occluder_parts_default();
    parts.field = field;
    vsh_occluders *occluders;
    vsh_error error;
    FUZZ_MAKE(occluders, vsh_occluders_from_parts(&parts, &occluders, fuzz_error(&error)));
    if (occluders == NULL) {
        return;
    }
    vsh_light light = vsh_light_default();
    light.angle = 0.3;
    vsh_shade_options options = vsh_shade_options_default();
    const vsh_points points = {POINTS, positions, normals, NULL};
    static const int32_t methods[] = {VSH_SHADOW_CONE, VSH_SHADOW_SMOOTH, VSH_SHADOW_ADAPTIVE};
    for (size_t i = 0; i < sizeof methods / sizeof methods[0]; ++i) {
        options.method = methods[i];
        vsh_shade_shadow(occluders, &points, &light, &options, run, values, NULL, NULL, fuzz_error(&error));
    }
    vsh_occluders_free(occluders);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (size < sizeof(vshi_stored_head) || size > FUZZ_MEMORY) {
        return 0;
    }
    char *bytes = malloc(size);
    if (bytes == NULL) {
        abort();
    }
    memcpy(bytes, data, size);
    forge_sums(bytes, size);
    const char *path = fuzz_file("a.field", bytes, size);
    const vsh_run run = fuzz_run();
    vsh_field_file *file;
    vsh_error error;
    const vsh_result result = vsh_field_file_open(path, &run, &file, fuzz_error(&error));
    fuzz_ended(result, &error, file);
    for (size_t i = 0; file != NULL && i < vsh_field_file_count(file) && i < 4; ++i) {
        vsh_field_options options = vsh_field_options_default();
        options.surface = 1;
        vsh_field *field;
        FUZZ_MAKE(field, vsh_field_file_field(file, i, &options, &run, &field, fuzz_error(&error)));
        if (field != NULL) {
            use(field, &run);
        }
        vsh_field_free(field);
        vsh_voxels *band;
        FUZZ_MAKE(band, vsh_field_file_band(file, i, 0.0, &run, &band, fuzz_error(&error)));
        vsh_voxels_free(band);
    }
    vsh_field_file_close(file);
    free(bytes);
    return 0;
}
