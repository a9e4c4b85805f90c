/* Files of bands that a bake keeps (--resume): those that the library wrote, changed in some places, or any
 * bytes, with sums of bands made those of what is there. What is taken of one is baked on, and what is then
 * kept is taken again as it is. The first byte tells of a whole lightmap or a part's, the second how the
 * others are taken. */
#include "fuzz.h"

#include "bake_scene/resume.h"
#include "base/part_sum.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/vdbshade.h>

enum { WIDTH = 6, BAND = 8, BANDS = 3, HEIGHT = BAND * BANDS - 2, MESHES = 2, ERRORS = 3, MOST = 1 << 16 };
enum { TEXELS = WIDTH * BAND, KEPT = 56 }; /* bytes of a texel of a part that leaves AO */

/* A lightmap's bands as they are baked, and the file that keeps them all. */
typedef struct source {
    vshi_channels channels;
    uint32_t known[TEXELS];
    unsigned char kept[TEXELS * KEPT];
    uint64_t invalid_by_mesh[MESHES];
    vsh_bake_error errors[ERRORS];
    unsigned char *bytes;
    size_t size, key; /* key: bytes in front of the first band */
} source;

static source sources[2]; /* of a whole lightmap, of a part */
static char output[512];

static int32_t rows_of(int band) {
    return band + 1 < BANDS ? BAND : HEIGHT - band * BAND;
}

/* Bytes that are kept of a band's AO. */
static size_t kept_bytes(const source *s, int band) {
    return s->channels.kept != NULL ? (size_t)WIDTH * (size_t)rows_of(band) * KEPT : 0;
}

static vshi_resume_key key_of(const source *s) {
    static const vsh_attribute attribute = {"of", "a fuzzer"};
    return (vshi_resume_key){.attributes = &attribute,
                             .attribute_count = 1,
                             .image = &s->channels.image,
                             .band_rows = BAND,
                             .part = s->channels.known != NULL,
                             .first = 0,
                             .end = HEIGHT};
}

static vsh_bake_stats stats_of(source *s) {
    vsh_bake_stats stats = vsh_bake_stats_zero();
    stats.invalid_by_mesh = s->invalid_by_mesh;
    stats.errors = s->errors;
    return stats;
}

/* Sets the values of a band to those of a bake. */
static void bake(source *s, int band, vsh_bake_stats *stats) {
    const size_t texels = (size_t)WIDTH * (size_t)rows_of(band);
    for (int32_t c = 0; c < s->channels.image.channel_count; ++c) {
        for (size_t i = 0; i < texels; ++i) {
            s->channels.planes[c][i] = (float)(i % 7) / 8.0f + (float)band;
        }
    }
    memset(s->known, band + 1, sizeof s->known);
    memset(s->kept, band + 2, sizeof s->kept);
    s->channels.kept_bytes = kept_bytes(s, band);
    stats->texels = (uint64_t)band * 10 + 1;
    stats->shade.rays = 7;
    s->invalid_by_mesh[1] = (uint64_t)band;
}

/* Whether there is a band to take. */
static bool take(source *s, vshi_resume *resume, int band, vsh_bake_stats *stats) {
    s->channels.kept_bytes = kept_bytes(s, band);
    return vshi_resume_take(resume, band * BAND, rows_of(band), &s->channels, stats, MESHES);
}

static bool open_bands(const source *s, const vsh_run *run, vshi_resume *resume) {
    const vshi_resume_key key = key_of(s);
    vsh_error error;
    const vsh_result result = vshi_resume_open(output, &key, ERRORS, run, resume, fuzz_error(&error));
    fuzz_ended(result, &error, resume->file);
    return result == VSH_OK;
}

static size_t load(unsigned char *bytes) {
    char path[600];
    snprintf(path, sizeof path, "%s.resume", output);
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        abort();
    }
    const size_t size = fread(bytes, 1, MOST, file);
    fclose(file);
    return size;
}

/* Bytes of what a band's sum is of. */
static size_t payload(const source *s, int band) {
    const size_t each = (size_t)s->channels.image.channel_count * sizeof(float) +
                        (s->channels.known != NULL ? sizeof s->known[0] : 0);
    return sizeof s->invalid_by_mesh + (size_t)WIDTH * (size_t)rows_of(band) * each + kept_bytes(s, band) +
           sizeof s->errors;
}

static void make_source(source *s, bool part) {
    vsh_scene scene = vsh_scene_default();
    scene.ao = 1;
    vsh_error error;
    if (vshi_channels_name(&scene, WIDTH, HEIGHT, &s->channels, &error) != VSH_OK ||
        vshi_channels_allocate(&s->channels, &scene, BAND, false, 0, output, &error) != VSH_OK) {
        abort();
    }
    s->channels.known = part ? s->known : NULL;
    s->channels.kept = part ? s->kept : NULL;
    const vsh_run run = fuzz_run();
    vshi_resume resume;
    vsh_bake_stats stats = stats_of(s);
    if (!open_bands(s, &run, &resume)) {
        abort();
    }
    s->bytes = malloc(MOST);
    s->key = load(s->bytes);
    for (int band = 0; band < BANDS; ++band) {
        bake(s, band, &stats);
        vshi_resume_keep(&resume, band * BAND, rows_of(band), &s->channels, &stats, MESHES);
    }
    if (vshi_resume_close(&resume) != HEIGHT) {
        abort();
    }
    s->size = load(s->bytes);
    vshi_resume_remove(output);
}

/* --- the input's */

static void change(fuzz_input *input, unsigned char *bytes, size_t *size) {
    uint16_t place;
    const uint8_t how = fuzz_byte(input);
    fuzz_fill(input, &place, sizeof place);
    const size_t width = (size_t)1 << how % 4;
    if (*size < width) {
        return;
    }
    const size_t at = place % (*size - width + 1);
    if ((how & 0x70) == 0x10) {
        *size = at;
    } else {
        fuzz_fill(input, bytes + at, width);
    }
}

/* The sums of bands, which stand behind their heads. */
static void forge(const source *s, unsigned char *bytes, size_t size) {
    size_t all = s->size - s->key;
    for (int band = 0; band < BANDS; ++band) {
        all -= payload(s, band);
    }
    const size_t head = all / BANDS;
    size_t at = s->key;
    for (int band = 0; band < BANDS && at + head + payload(s, band) <= size; ++band) {
        const uint64_t sum = vshi_part_sum(VSHI_PART_SUM, bytes + at + head, payload(s, band));
        memcpy(bytes + at + head - sizeof sum, &sum, sizeof sum);
        at += head + payload(s, band);
    }
}

static void check_kept(source *s, const vsh_run *run) {
    vshi_resume resume;
    vsh_bake_stats stats = stats_of(s);
    if (!open_bands(s, run, &resume)) {
        abort();
    }
    for (int band = 0; band < BANDS; ++band) {
        if (!take(s, &resume, band, &stats)) {
            abort();
        }
    }
    if (vshi_resume_close(&resume) != HEIGHT) {
        abort();
    }
}

static void resume_bake(source *s, const unsigned char *bytes, size_t size) {
    const vsh_run run = fuzz_run();
    vshi_resume resume;
    vsh_bake_stats stats = stats_of(s);
    if (!open_bands(s, &run, &resume)) { /* what is not ours stays */
        static unsigned char left[MOST];
        if (load(left) != size || memcmp(left, bytes, size) != 0) {
            abort();
        }
        return;
    }
    bool taking = true;
    for (int band = 0; band < BANDS; ++band) {
        const bool taken = take(s, &resume, band, &stats);
        if (taken && !taking) {
            abort();
        }
        taking = taken;
        if (!taken) {
            bake(s, band, &stats);
            vshi_resume_keep(&resume, band * BAND, rows_of(band), &s->channels, &stats, MESHES);
        }
    }
    if (vshi_resume_close(&resume) != HEIGHT) {
        abort();
    }
    check_kept(s, &run);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (sources[0].bytes == NULL) {
        snprintf(output, sizeof output, "%s/out.exr", fuzz_folder());
        make_source(&sources[0], false);
        make_source(&sources[1], true);
    }
    fuzz_input input = {data, size};
    source *s = &sources[fuzz_byte(&input) % 2];
    const uint8_t how = fuzz_byte(&input);
    unsigned char *bytes = malloc(MOST);
    if (bytes == NULL) {
        abort();
    }
    const bool raw = how % 8 == 7 && input.left <= MOST;
    size_t count = raw ? input.left : s->size;
    if (raw) {
        fuzz_fill(&input, bytes, count);
    } else {
        memcpy(bytes, s->bytes, count);
    }
    while (!raw && input.left > 0) {
        change(&input, bytes, &count);
    }
    if (how < 0xf0) {
        forge(s, bytes, count);
    }
    fuzz_file("out.exr.resume", bytes, count);
    resume_bake(s, bytes, count);
    vshi_resume_remove(output);
    free(bytes);
    return 0;
}
