/* Merges parts of bakes: parts that the library made at the start, changed in some places, or any bytes.
 * Their checksums are corrected, because merging stops at a wrong one. The first byte chooses the bake and
 * the part, the second how to use the others. */
#include "fuzz.h"

#include "scene/bake_scene.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/vdbshade.h>

/* Two tiles, one below the other: one for each shard. */
enum { WIDTH = 16, HEIGHT = 80, SHARDS = 2, MOST = 1 << 20 };

static const char floor_text[] = "v -2 0 -2\nv 2 0 -2\nv 2 0 2\nv -2 0 2\nvt 0 1\nvt 1 1\nvt 1 0\nvt 0 0\n"
                                 "f 1/1 3/3 2/2\nf 1/1 4/4 3/3\n";
static const char wall_text[] = "v -2 -1 0\nv 1 -1 0\nv 1 1 0.5\nv -2 1 0.5\nf 1 2 3\nf 1 3 4\n";

/* Two scenes: light with AO by cones; and AO whose shots are in the parts, with all planes that depend on
 * it. */
static const char *const scenes[] = {
    "{\"casters\":[{\"sdf\":{\"shape\":\"sphere\",\"radius\":0.7}}],\"resolution\":16,\"irradiance\":true,"
    "\"method\":\"cone\","
    "\"lights\":[{\"name\":\"sun\",\"type\":\"directional\",\"direction\":[0,1,0],\"angle_deg\":5}],"
    "\"ao\":{\"distance\":1,\"method\":\"cones\"},"
    "\"receivers\":[{\"mesh\":\"floor.obj\",\"size\":[16,80],\"padding\":2,\"output\":\"0.exr\"}]}",
    "{\"casters\":[{\"mesh\":\"wall.obj\"}],\"error\":true,\"irradiance\":true,\"sky\":\"y\","
    "\"lights\":[{\"name\":\"sun\",\"type\":\"directional\",\"direction\":[0,1,0],\"angle_deg\":5}],"
    "\"ao\":{\"distance\":1,\"method\":\"exact\",\"bent_normals\":\"tangent\"},"
    "\"receivers\":[{\"mesh\":\"floor.obj\",\"size\":[16,80],\"ao_spacing\":2,\"output\":\"1.exr\"}]}"};

enum { KINDS = sizeof scenes / sizeof scenes[0] };

/* A scene, and the parts of its bake. */
typedef struct source {
    vsh_scene *scene;
    char name[512];
    unsigned char *bytes[SHARDS];
    size_t size[SHARDS];
} source;

static source sources[KINDS];

/* --- scenes and parts, made before the first input */

static void bake_scene(source *s, int kind) {
    char file[32];
    snprintf(file, sizeof file, "%d.json", kind);
    const char *const path = fuzz_file(file, scenes[kind], strlen(scenes[kind]));
    FUZZ_REQUIRE(vsh_scene_read(path, NULL, &s->scene, NULL) == VSH_OK);
    for (int32_t shard = 1; shard <= SHARDS; ++shard) {
        static const char *const words[] = {"bake", "a b"};
        vsh_bake_options options = vsh_bake_options_default();
        options.shard = shard;
        options.shard_count = SHARDS;
        options.parts = s->name;
        options.words = words;
        options.word_count = 2;
        FUZZ_REQUIRE(vsh_bake_scene(s->scene, &options, NULL, NULL, NULL) == VSH_OK);
    }
}

static void load(source *s, int shard) {
    char path[600];
    snprintf(path, sizeof path, "%s.%d-of-%d.part", s->name, shard + 1, SHARDS);
    FILE *file = fopen(path, "rb");
    s->bytes[shard] = malloc(MOST);
    FUZZ_REQUIRE(file != NULL && s->bytes[shard] != NULL);
    s->size[shard] = fread(s->bytes[shard], 1, MOST, file);
    fclose(file);
}

static void make_sources(void) {
    fuzz_file("floor.obj", floor_text, sizeof floor_text - 1);
    fuzz_file("wall.obj", wall_text, sizeof wall_text - 1);
    for (int kind = 0; kind < KINDS; ++kind) {
        source *s = &sources[kind];
        snprintf(s->name, sizeof s->name, "%s/%d.exr", fuzz_folder(), kind);
        bake_scene(s, kind);
        for (int shard = 0; shard < SHARDS; ++shard) {
            load(s, shard);
        }
    }
}

/* --- a part made from the input */

typedef struct part {
    unsigned char *at;
    size_t size;
} part;

/* Changes, cuts out or puts in a few bytes, in the head, the numbers of the first tile or anywhere. */
static void change(fuzz_input *input, part *p) {
    vshi_part_front front;
    uint32_t place;
    memcpy(&front, p->at, sizeof front);
    const uint8_t how = fuzz_byte(input);
    fuzz_fill(input, &place, sizeof place);
    const size_t width = (size_t)1 << how % 4, body = p->size - sizeof(uint64_t);
    const size_t numbers = sizeof(vsh_shade_stats);
    size_t begin = 0, end = body;
    if ((how & 12) == 4 && front.head_bytes < body - sizeof front) {
        end = sizeof front + (size_t)front.head_bytes;
    } else if ((how & 12) == 8 && front.head_bytes < body - sizeof front - numbers) {
        begin = sizeof front + (size_t)front.head_bytes;
        end = begin + numbers;
    }
    if (end - begin < width) {
        return;
    }
    const size_t at = begin + place % (end - begin - width + 1);
    const size_t more = 4 * (1 + (size_t)place / 7 % 16);
    if ((how & 0x70) == 0x10 && p->size > at + more + sizeof(uint64_t)) {
        memmove(p->at + at, p->at + at + more, p->size - at - more);
        p->size -= more;
    } else if ((how & 0x70) == 0x20 && p->size + more <= MOST) {
        memmove(p->at + at + more, p->at + at, p->size - at);
        fuzz_fill(input, p->at + at, more);
        p->size += more;
    } else {
        fuzz_fill(input, p->at + at, width);
    }
}

static void forge_sum(part *p) {
    const size_t body = p->size - sizeof(uint64_t);
    const uint64_t sum = vshi_part_sum(VSHI_PART_SUM, p->at, body);
    memcpy(p->at + body, &sum, sizeof sum);
}

static part make_part(fuzz_input *input, const source *s, int shard) {
    const uint8_t how = fuzz_byte(input);
    part p = {malloc(MOST), 0};
    if (how % 8 == 7 && input->left <= MOST) {
        p.size = input->left;
        fuzz_fill(input, p.at, p.size);
    } else {
        p.size = s->size[shard];
        memcpy(p.at, s->bytes[shard], p.size);
        while (input->left > 0) {
            change(input, &p);
        }
    }
    if (p.size >= sizeof(vshi_part_front) + sizeof(uint64_t) && how < 0xf0) {
        forge_sum(&p);
    }
    return p;
}

/* --- the calls under test */

static vsh_result count_rows(void *user, const vsh_scene_lightmap *lightmap, const vsh_image *image,
                             int32_t first, int32_t count, const float *const *planes, vsh_error *error) {
    int32_t *rows = user;
    FUZZ_REQUIRE(lightmap->width == WIDTH && image->width == WIDTH && image->height == HEIGHT);
    FUZZ_REQUIRE(planes[0] != NULL && first + count <= HEIGHT);
    *rows = first + count;
    return VSH_OK;
}

static void merge_lightmaps(const source *s) {
    int32_t rows = 0;
    const vsh_run run = fuzz_run();
    vsh_bake_options options = vsh_bake_options_default();
    options.rows = count_rows;
    options.user = &rows;
    options.parts = s->name;
    const vsh_result result = fuzz_check_plain(vsh_merge_scene(s->scene, &options, &run, NULL, fuzz_error()));
    FUZZ_REQUIRE(result != VSH_OK || rows == HEIGHT);
}

static void read_words(const source *s) {
    const vsh_run run = fuzz_run();
    char **words = NULL;
    size_t count = 0;
    FUZZ_MAKE(words, vsh_part_words(s->name, 0, &run, &words, &count, fuzz_error()));
    FUZZ_REQUIRE(words == NULL || words[count] == NULL);
    vsh_part_words_free(words);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (sources[0].scene == NULL) {
        make_sources();
    }
    fuzz_input input = {data, size};
    const uint8_t which = fuzz_byte(&input);
    const source *s = &sources[which % KINDS];
    const int shard = which / KINDS % SHARDS;
    part p = make_part(&input, s, shard);
    char name[64];
    snprintf(name, sizeof name, "%s.%d-of-%d.part", strrchr(s->name, '/') + 1, shard + 1, SHARDS);
    fuzz_file(name, p.at, p.size);
    merge_lightmaps(s);
    read_words(s);
    fuzz_file(name, s->bytes[shard], s->size[shard]);
    free(p.at);
    return 0;
}
