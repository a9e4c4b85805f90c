/* Materials that cut out casters: from glTF and its textures to rays, in the process itself and by a reader,
 * which is this test. */
#include "gltf_maker.h"
#include "handles.h"

#include "base/vec.h"
#include "trace/trace.h"

/* A card of CELLS × CELLS quads in the plane y = 1, from -1 to 1, the image's top at z = -1; on it a disc. */
enum { CELLS = 8, CORNERS = (CELLS + 1) * (CELLS + 1), TRIANGLES = 2 * CELLS * CELLS, TEXELS = 160 };
static const double CENTRE[2] = {-0.4, -0.3}, RADIUS = 0.4;

typedef struct bytes {
    unsigned char *at;
    size_t size;
} bytes;

/* The disc in the alpha of an image: 1 in it, `outside` out of it. */
static bytes disc_image(float outside) {
    static float alpha[TEXELS * TEXELS], grey[TEXELS * TEXELS];
    for (int y = 0; y < TEXELS; ++y) {
        for (int x = 0; x < TEXELS; ++x) {
            const double off =
                hypot(2.0 * (x + 0.5) / TEXELS - 1.0 - CENTRE[0], 2.0 * (y + 0.5) / TEXELS - 1.0 - CENTRE[1]);
            const double share = fmin(1.0, fmax(0.0, 0.5 + 20.0 * (RADIUS - off)));
            alpha[y * TEXELS + x] = outside + (1.0f - outside) * (float)share;
            grey[y * TEXELS + x] = 0.25f;
        }
    }
    const char *const names[] = {"R", "G", "B", "A"};
    const float *const planes[] = {grey, grey, grey, alpha};
    const vsh_image image = {TEXELS, TEXELS, 4, names, planes, NULL};
    vsh_image_options options = vsh_image_options_default();
    options.bits = 8;
    options.pack = "R=R,G=G,B=B,A=A";
    const char *path = at("disc.png");
    assert_ok(vsh_image_write(path, &image, &options, &failure));
    bytes b;
    b.size = read_all(path, &b.at);
    assert_int_equal(unlink(path), 0);
    return b;
}

static char *data_uri(bytes b) {
    char *text = malloc(2 * b.size + 64);
    strcpy(text, "data:image/png;base64,");
    base64(b.at, b.size, text + strlen(text));
    return text;
}

/* a.gltf, with the card under material 0; its UVs times `scale`. */
static void write_card(const char *materials, const char *sampler, const char *image_uri, float scale) {
    static float positions[3 * CORNERS], uvs[2 * CORNERS];
    static uint16_t indices[3 * TRIANGLES];
    size_t next = 0;
    for (size_t i = 0; i < CORNERS; ++i) {
        const float x = (float)(i % (CELLS + 1)) / CELLS, z = (float)(i / (CELLS + 1)) / CELLS;
        const float place[3] = {2.0f * x - 1.0f, 1.0f, 2.0f * z - 1.0f};
        memcpy(positions + 3 * i, place, sizeof place);
        uvs[2 * i] = scale * x;
        uvs[2 * i + 1] = scale * z;
    }
    for (uint16_t cell = 0; cell < CELLS * CELLS; ++cell) {
        const uint16_t a = (uint16_t)(cell / CELLS * (CELLS + 1) + cell % CELLS);
        const uint16_t b = (uint16_t)(a + CELLS + 1);
        const uint16_t corners[6] = {a, b, (uint16_t)(b + 1), a, (uint16_t)(b + 1), (uint16_t)(a + 1)};
        memcpy(indices + next, corners, sizeof corners);
        next += 6;
    }
    FREED maker *m = calloc(1, sizeof *m);
    add(m, positions, sizeof positions, "", FLOATS, CORNERS, "VEC3", "");
    add(m, uvs, sizeof uvs, "", FLOATS, CORNERS, "VEC2", "");
    add(m, indices, sizeof indices, "", USHORTS, 3 * TRIANGLES, "SCALAR", "");
    const size_t room = strlen(image_uri) + 4096;
    FREED char *rest = malloc(room);
    snprintf(rest, room,
             NODE(",\"name\":\"card\"")
                 MESH("\"POSITION\":0,\"TEXCOORD_0\":1",
                      ",\"indices\":2,\"material\":0") ",\"materials\":[%s],"
                                                       "\"textures\":[{\"source\":0,\"sampler\":0}],"
                                                       "\"samplers\":[%s],\"images\":[{\"uri\":\"%s\"}]",
             materials, sampler, image_uri);
    const char *json = text_of(m, rest);
    write_all(at("a.gltf"), json, strlen(json));
}

#define MASKED(more)                                                                                         \
    "{\"name\":\"leaf\",\"alphaMode\":\"MASK\",\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0"  \
    "}" more "}}"

/* A card's file, and how it is loaded. Members that are 0 or NULL get the defaults in these comments. */
typedef struct card {
    const char *material; /* masked by the disc */
    const char *sampler;  /* repeats */
    const char *uri;      /* the image itself */
    float outside;        /* alpha out of the disc */
    float scale;          /* of UVs; 1 */
    bool reader, cast_blended;
    uint64_t memory_limit;
} card;

static vsh_result load(card c, vsh_assets **assets) {
    const bytes png = disc_image(c.outside);
    char *own = data_uri(png);
    write_card(c.material != NULL ? c.material : MASKED(""), c.sampler != NULL ? c.sampler : "{}",
               c.uri != NULL ? c.uri : own, c.scale > 0.0f ? c.scale : 1.0f);
    const char *path = at("a.gltf");
    vsh_caster caster = {
        .type = VSH_CASTER_MESH, .path = path, .transform = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
    vsh_scene scene = vsh_scene_default();
    scene.casters = &caster;
    scene.caster_count = 1;
    scene.cast_blended = c.cast_blended;
    vsh_run run = vsh_run_default();
    run.warning = keep_warning;
    run.notes = 1;
    run.memory_limit = c.memory_limit;
    run.reader = c.reader ? "/proc/self/exe" : NULL;
    run.reader_seconds = c.reader ? 120.0 : 0.0;
    warnings[0] = '\0';
    const vsh_result result = vsh_assets_load(&scene, &run, assets, &failure);
    assert_int_equal(unlink(path), 0);
    free(own);
    free(png.at);
    return result;
}

static int by_disc(double x, double z) {
    const double off = hypot(x - CENTRE[0], z - CENTRE[1]) - RADIUS;
    return fabs(off) < 3e-3 ? -1 : off < 0.0;
}

static int everywhere(double x, double z) {
    return 1;
}

/* Rays upwards from all over the card: `expected` says which are blocked (1; -1: too near to an edge to say).
 */
static void assert_casts(card c, int (*expected)(double x, double z)) {
    OWNED(vsh_assets) *assets = NULL;
    assert_ok(load(c, &assets));
    size_t count = 0;
    const vsh_mesh *meshes = vsh_assets_caster(assets, 0, &count);
    OWNED(vshi_triangles) *triangles = triangles_from(meshes, count);
    int met = 0, asked = 0;
    for (int i = 0; i < 79 * 79; ++i) {
        const double x = -0.98 + 0.025 * (i % 79), z = -0.98 + 0.025 * (i / 79);
        const vshi_segment_ray ray = {{x, 0.0, z}, {0.0, 1.0, 0.0}, INFINITY};
        bool blocked = false;
        vshi_triangles_blocked(triangles, &ray, 1, &blocked);
        const int is = expected(x, z);
        assert_that(is < 0 || blocked == (is == 1), "(%g, %g) is %s", x, z, blocked ? "blocked" : "free");
        met += is >= 0 && blocked;
        asked += is >= 0;
    }
    assert_true(asked > 5000 && met > 150);
}

TEST(a_card_casts_the_disc_in_its_textures_alpha) {
    const bytes png = disc_image(0.0f);
    write_all(at("leaf.png"), png.at, png.size);
    for (int i = 0; i < 4; ++i) {
        assert_casts((card){.reader = (i & 1) != 0, .uri = (i & 2) != 0 ? "leaf.png" : NULL}, by_disc);
        assert_string_equal(warnings, "");
    }
    assert_int_equal(unlink(at("leaf.png")), 0);
    free(png.at);
}

/* Opaque triangles are a mesh without a mask, and clear ones are left out. */
TEST(only_triangles_that_an_edge_crosses_keep_the_mask) {
    OWNED(vsh_assets) *assets = NULL;
    assert_ok(load((card){0}, &assets));
    size_t count = 0;
    const vsh_mesh *meshes = vsh_assets_caster(assets, 0, &count);
    assert_int_equal(count, 2);
    assert_null(meshes[0].mask);
    assert_non_null(meshes[1].mask);
    assert_int_equal(meshes[1].solidity, VSH_SOLIDITY_SHELL);
    assert_string_equal(meshes[1].material_name, "leaf");
    assert_in_range(meshes[0].triangle_count, 1, 20);
    assert_in_range(meshes[1].triangle_count, 20, 60);
}

/* Twice across the card: the second disc lies the other way round. */
static int mirrored(double x, double z) {
    return by_disc(x < 0.0 ? 2.0 * x + 1.0 : 1.0 - 2.0 * x, z < 0.0 ? 2.0 * z + 1.0 : 1.0 - 2.0 * z);
}

static int turned(double x, double z) {
    return by_disc(-x, -z);
}

TEST(wraps_and_texture_transforms_are_those_of_the_file) {
    static const char transformed[] =
        "{\"alphaMode\":\"MASK\",\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0,\"extensions\":"
        "{\"KHR_texture_transform\":{\"offset\":[1,1],\"scale\":[-1,-1]}}}}}";
    static const struct {
        const char *sampler, *material;
        float scale;
        int (*expected)(double x, double z);
    } cases[] = {{"{\"wrapS\":33648,\"wrapT\":33648}", NULL, 2.0f, mirrored},
                 {NULL, transformed, 1.0f, turned}};
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        assert_casts(
            (card){.material = cases[i].material, .sampler = cases[i].sampler, .scale = cases[i].scale},
            cases[i].expected);
    }
}

#define TEXTURE "\"baseColorTexture\":{\"index\":0}"
#define BASE(factor, more) "\"pbrMetallicRoughness\":{\"baseColorFactor\":[1,1,1," factor "]" more "}"

/* A texture's alpha is `outside` out of the disc and 1 in it. */
TEST(mode_cutoff_and_base_factor_decide_what_casts) {
    static const struct {
        const char *material; /* without its name */
        float outside;
        bool cast_blended;
        int (*expected)(double x, double z); /* NULL: nothing casts */
    } cases[] = {
        {"\"alphaMode\":\"MASK\",\"alphaCutoff\":0.3,\"pbrMetallicRoughness\":{" TEXTURE "}", 0.4f, false,
         everywhere},
        {"\"alphaMode\":\"MASK\",\"alphaCutoff\":0.35," BASE("0.5", "," TEXTURE), 0.4f, false, by_disc},
        {"\"alphaMode\":\"MASK\"," BASE("0.4", "," TEXTURE), 0.4f, false, NULL},
        {"\"alphaMode\":\"MASK\"," BASE("0.4", ""), 0.4f, false, NULL},
        {"\"alphaMode\":\"MASK\"," BASE("0.6", ""), 0.4f, false, everywhere},
        {"\"alphaMode\":\"MASK\",\"alphaCutoff\":0", 0.4f, false, everywhere},
        /* blended: cast if they are cut out, or if asked */
        {"\"alphaMode\":\"BLEND\",\"pbrMetallicRoughness\":{" TEXTURE "}", 0.0f, false, by_disc},
        {"\"alphaMode\":\"BLEND\",\"pbrMetallicRoughness\":{" TEXTURE "}", 0.3f, false, NULL},
        {"\"alphaMode\":\"BLEND\"," BASE("0.3", "," TEXTURE), 0.0f, false, NULL},
        {"\"alphaMode\":\"BLEND\"," BASE("0.3", "," TEXTURE), 0.0f, true, by_disc},
        {"\"alphaMode\":\"BLEND\"," BASE("0.3", ""), 0.0f, false, NULL},
        {"\"alphaMode\":\"BLEND\"," BASE("0.3", ""), 0.0f, true, everywhere}};
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        const bool blended = i >= 6;
        char material[256];
        snprintf(material, sizeof material, "{\"name\":\"leaf\",%s}", cases[i].material);
        const card c = {
            .material = material, .outside = cases[i].outside, .cast_blended = cases[i].cast_blended};
        if (cases[i].expected == NULL) {
            OWNED(vsh_assets) *assets = NULL;
            assert_fails(load(c, &assets), VSH_ERROR_INPUT, blended ? "blended" : "leave nothing");
            continue;
        }
        assert_casts(c, cases[i].expected);
        assert_int_equal(strstr(warnings, "at least half") != NULL, blended && !c.cast_blended);
    }
}

TEST(textures_that_are_missing_or_damaged_leave_the_card_whole) {
    const bytes png = disc_image(0.0f);
    unsigned char damaged[512];
    memcpy(damaged, png.at, sizeof damaged);
    memset(damaged + 40, 0x55, sizeof damaged - 40);
    const bytes none[] = {{png.at, png.size / 2},
                          {damaged, sizeof damaged},
                          {(unsigned char *)(uintptr_t) "no image", 8},
                          {(unsigned char *)(uintptr_t) "\xff\xd8\xff\xe0 nor this", 14},
                          {(unsigned char *)(uintptr_t) "RIFF\1\0\0\0WEBPVP8 ", 16}};
    for (size_t i = 0; i < 2 * (COUNT_OF(none) + 1); ++i) {
        const bool missing = i / 2 == COUNT_OF(none);
        FREED char *uri = missing ? strdup("gone.png") : data_uri(none[i / 2]);
        assert_casts((card){.reader = i % 2 != 0, .uri = uri}, everywhere);
        assert_non_null(strstr(warnings, "material 'leaf' casts whole"));
        assert_null(strchr(warnings, '\n'));
    }
    free(png.at);
}

TEST(cards_without_uvs_are_whole) {
    assert_casts((card){.material = "{\"name\":\"leaf\",\"alphaMode\":\"MASK\",\"pbrMetallicRoughness\":{"
                                    "\"baseColorTexture\":{\"index\":0,\"texCoord\":2}}}"},
                 everywhere);
    assert_non_null(strstr(warnings, "no UV set 2"));
}

TEST(a_texture_past_the_memory_limit_is_an_error) {
    vsh_assets *assets = NULL;
    assert_fails(load((card){.memory_limit = 4 * TEXELS * TEXELS * sizeof(float) - 1}, &assets),
                 VSH_ERROR_LIMIT, "material 'leaf'");
    assert_null(assets);
}

FIXTURE(make_folder, remove_empty_folder)
