/* An asset with a sample of every feature (tests/unit/test_lit…). */
#pragma once

#include "assets.h"

static inline void assert_file(const char *name, const void *expected, size_t expected_size) {
    FREED unsigned char *bytes = NULL;
    assert_int_equal(read_all(at(name), &bytes), expected_size);
    assert_memory_equal(bytes, expected, expected_size);
}

enum { SIDE = 5, QUADS = (SIDE - 1) * (SIDE - 1), VERTICES = SIDE * SIDE, INDICES = 6 * QUADS };

/* Interleaved positions, normals and UVs as shorts; colours of three bytes; numbers of two; joints, weights.
 */
typedef struct rich_vertex {
    float position[3], normal[3];
    uint16_t uv[2];
} rich_vertex;

static inline void rich_vertices(asset *a, json_t **attributes) {
    rich_vertex v[VERTICES];
    unsigned char colors[VERTICES][4] = {{0}}, joints[VERTICES][4] = {{0}};
    uint16_t ids[VERTICES][2] = {{0}};
    float weights[VERTICES][4] = {{0}};
    for (int i = 0; i < VERTICES; ++i) {
        const float x = (float)(i % SIDE), z = (float)(i / SIDE);
        v[i] = (rich_vertex){{x, 0.0F, z},
                             {0.0F, 1.0F, 0.0F},
                             {(uint16_t)(16383 * (i % SIDE)), (uint16_t)(16383 * (i / SIDE))}};
        for (int k = 0; k < 3; ++k) {
            colors[i][k] = (unsigned char)(i * 7 + k);
        }
        ids[i][0] = (uint16_t)(1000 + i);
        joints[i][1] = 1;
        weights[i][0] = 0.25F;
        weights[i][1] = 0.75F;
    }
    const int view = put_view(a, v, sizeof v, sizeof v[0], 34962);
    const int color_view = put_view(a, colors, sizeof colors, 4, 34962),
              id_view = put_view(a, ids, sizeof ids, 4, 34962);
    const int joint_view = put_view(a, joints, sizeof joints, 0, 34962),
              weight_view = put_view(a, weights, sizeof weights, 0, 34962);
    const int positions =
        put_accessor(a, view, 0, 5126, VERTICES, "VEC3",
                     ",\"min\":[0,0,0],\"max\":[4,0,4],\"name\":\"grid\",\"extras\":{\"a\":[1,2]}");
    const int normals = put_accessor(a, view, 12, 5126, VERTICES, "VEC3", "");
    const int uvs = put_accessor(a, view, 24, 5123, VERTICES, "VEC2", ",\"normalized\":true");
    const int color = put_accessor(a, color_view, 0, 5121, VERTICES, "VEC3", ",\"normalized\":true");
    const int id = put_accessor(a, id_view, 0, 5123, VERTICES, "SCALAR", ",\"min\":[1000],\"max\":[1024]");
    const int joint = put_accessor(a, joint_view, 0, 5121, VERTICES, "VEC4", "");
    const int weight = put_accessor(a, weight_view, 0, 5126, VERTICES, "VEC4", "");
    *attributes =
        json_pack("{s:i,s:i,s:i,s:i,s:i,s:i,s:i}", "POSITION", positions, "NORMAL", normals, "TEXCOORD_0",
                  uvs, "COLOR_0", color, "_ID", id, "JOINTS_0", joint, "WEIGHTS_0", weight);
}

/* A morph target that moves three vertices, by a sparse accessor, and turns all normals. */
static inline json_t *rich_target(asset *a) {
    const uint16_t moved[3] = {3, 4, 20};
    const float moves[3][3] = {{0, 1, 0}, {0, 2, 0}, {0, 0.5F, 0}};
    float normals[VERTICES][3];
    for (int i = 0; i < VERTICES; ++i) {
        normals[i][0] = 0.01F * (float)i;
        normals[i][1] = normals[i][2] = 0.0F;
    }
    char text[512];
    const int indices = put_view(a, moved, sizeof moved, 0, 0),
              values = put_view(a, moves, sizeof moves, 0, 0);
    snprintf(
        text, sizeof text,
        "{\"componentType\":5126,\"count\":%d,\"type\":\"VEC3\",\"min\":[0,0,0],\"max\":[0,2,0],\"sparse\":{"
        "\"count\":3,\"indices\":{\"bufferView\":%d,\"componentType\":5123},\"values\":{\"bufferView\":%d}}}",
        VERTICES, indices, values);
    const int sparse = put_item(a, "accessors", parsed(text));
    const int dense =
        put_accessor(a, put_view(a, normals, sizeof normals, 0, 34962), 0, 5126, VERTICES, "VEC3", "");
    return json_pack("{s:i,s:i}", "POSITION", sparse, "NORMAL", dense);
}

static inline int rich_indices(asset *a) {
    uint16_t indices[INDICES];
    size_t n = 0;
    for (int q = 0; q < QUADS; ++q) {
        const int at = q % (SIDE - 1) + SIDE * (q / (SIDE - 1));
        const int corners_of[6] = {at, at + SIDE, at + 1, at + 1, at + SIDE, at + SIDE + 1};
        for (int k = 0; k < 6; ++k) {
            indices[n++] = (uint16_t)corners_of[k];
        }
    }
    return put_accessor(a, put_view(a, indices, sizeof indices, 0, 34963), 0, 5123, INDICES, "SCALAR", "");
}

static inline json_t *attributes_of(const json_t *all, const char *const *names) {
    json_t *some = json_object();
    for (; *names != NULL; ++names) {
        json_object_set(some, *names, json_object_get(all, *names));
    }
    return some;
}

/* Meshes: 0 with morph targets, used by three nodes; 1 skinned; 2 of two halves, instanced; 3 a strip and
 * points. */
static inline void rich_meshes(asset *a) {
    static const char *const plain[] = {"POSITION", "NORMAL", "TEXCOORD_0", "COLOR_0", "_ID", NULL};
    static const char *const skin[] = {"POSITION", "NORMAL", "JOINTS_0", "WEIGHTS_0", NULL};
    static const char *const bare[] = {"POSITION", "NORMAL", NULL};
    json_t *all;
    rich_vertices(a, &all);
    const int indices = rich_indices(a);
    uint16_t strip[SIDE * 2];
    for (int i = 0; i < SIDE; ++i) {
        strip[2 * i] = (uint16_t)i;
        strip[2 * i + 1] = (uint16_t)(i + SIDE);
    }
    const int strip_view = put_view(a, strip, sizeof strip, 0, 34963);
    const int halves = (int)json_integer_value(
        json_object_get(json_array_get(list_of(a, "accessors"), (size_t)indices), "bufferView"));
    const int first = put_accessor(a, halves, 0, 5123, INDICES / 2, "SCALAR", "");
    const int second = put_accessor(a, halves, INDICES, 5123, INDICES / 2, "SCALAR", "");
    const int strips = put_accessor(a, strip_view, 0, 5123, SIDE * 2, "SCALAR", "");
    put_item(
        a, "meshes",
        json_pack("{s:s,s:[{s:o,s:i,s:i,s:[o],s:{s:s},s:{s:{s:[{s:i,s:[i]},{s:i,s:[i]}]}}}],s:[f],s:{s:[s]}}",
                  "name", "morphed", "primitives", "attributes", attributes_of(all, plain), "indices",
                  indices, "material", 0, "targets", rich_target(a), "extras", "of", "a primitive",
                  "extensions", "KHR_materials_variants", "mappings", "material", 0, "variants", 0,
                  "material", 1, "variants", 1, "weights", 0.25, "extras", "targetNames", "up"));
    put_item(a, "meshes",
             json_pack("{s:s,s:[{s:o,s:i,s:i}]}", "name", "skinned", "primitives", "attributes",
                       attributes_of(all, skin), "indices", indices, "material", 1));
    put_item(a, "meshes",
             json_pack("{s:[{s:o,s:i,s:i},{s:o,s:i}]}", "primitives", "attributes", attributes_of(all, plain),
                       "indices", first, "material", 1, "attributes", attributes_of(all, plain), "indices",
                       second));
    put_item(a, "meshes",
             json_pack("{s:[{s:o,s:i,s:i,s:i},{s:o,s:i,s:i}]}", "primitives", "attributes",
                       attributes_of(all, bare), "indices", strips, "mode", 5, "material", 2, "attributes",
                       attributes_of(all, bare), "mode", 0, "material", 2));
    json_decref(all);
}

static inline void rich_nodes(asset *a) {
    const float moved[3][3] = {{0, 0, 10}, {6, 0, 10}, {12, 0, 10}},
                bind[2][16] = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                               {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 1}};
    const int16_t turned[3][4] = {{0, 0, 0, 32767}, {0, 23170, 0, 23170}, {0, 32767, 0, 0}};
    const int moves = put_accessor(a, put_view(a, moved, sizeof moved, 0, 0), 0, 5126, 3, "VEC3", "");
    const int turns =
        put_accessor(a, put_view(a, turned, sizeof turned, 0, 0), 0, 5122, 3, "VEC4", ",\"normalized\":true");
    const int binds = put_accessor(a, put_view(a, bind, sizeof bind, 0, 0), 0, 5126, 2, "MAT4", "");
    const float times[2] = {0, 1}, places[2][3] = {{0, 0, 0}, {0, 1, 0}}, amounts[2] = {0, 1};
    const int time = put_accessor(a, put_view(a, times, sizeof times, 0, 0), 0, 5126, 2, "SCALAR",
                                  ",\"min\":[0],\"max\":[1]");
    const int place = put_accessor(a, put_view(a, places, sizeof places, 0, 0), 0, 5126, 2, "VEC3", "");
    const int amount = put_accessor(a, put_view(a, amounts, sizeof amounts, 0, 0), 0, 5126, 2, "SCALAR", "");
    char text[4096];
    snprintf(
        text, sizeof text,
        "[{\"name\":\"root\",\"children\":[1,2,4,6,7,9],\"extras\":{\"level\":\"one\",\"n\":0.1}},"
        "{\"name\":\"left\",\"mesh\":0,\"translation\":[-5.5,0,0],\"extensions\":{\"VENDOR_sound\":{\"file\":"
        "\"a.ogg\"}}},"
        "{\"name\":\"right\",\"mesh\":0,\"translation\":[6,0.125,0],\"rotation\":[0,0.70710678,0,0.70710678],"
        "\"weights\":[1]},"
        "{\"name\":\"man\",\"mesh\":1,\"skin\":0},{\"name\":\"hip\",\"children\":[5],\"translation\":[0,3,0]}"
        ",{\"name\":\"knee\",\"translation\":[1,0,0]},"
        "{\"name\":\"eye\",\"camera\":0,\"extensions\":{\"KHR_lights_punctual\":{\"light\":0}}},"
        "{\"name\":\"many\",\"mesh\":2,\"scale\":[0.5,0.5,0.5],\"extensions\":{\"EXT_mesh_gpu_instancing\":{"
        "\"attributes\":{\"TRANSLATION\":%d,\"ROTATION\":%d}}}},"
        "{\"name\":\"elsewhere\",\"mesh\":0},{\"mesh\":3,\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0,0,-2,0,1]}]",
        moves, turns);
    json_object_set_new(a->root, "nodes", parsed(text));
    json_object_set_new(a->root, "scene", json_integer(0));
    json_object_set_new(a->root, "scenes",
                        parsed("[{\"nodes\":[0,3],\"name\":\"main\"},{\"nodes\":[8],\"extras\":7}]"));
    put_item(a, "skins",
             json_pack("{s:i,s:[i,i],s:i}", "inverseBindMatrices", binds, "joints", 4, 5, "skeleton", 4));
    put_item(a, "animations",
             json_pack("{s:s,s:[{s:i,s:i,s:s},{s:i,s:i}],s:[{s:i,s:{s:i,s:s}},{s:i,s:{s:i,s:s}}]}", "name",
                       "up", "samplers", "input", time, "output", place, "interpolation", "STEP", "input",
                       time, "output", amount, "channels", "sampler", 0, "target", "node", 1, "path",
                       "translation", "sampler", 1, "target", "node", 2, "path", "weights"));
}

static inline void rich_rest(asset *a) {
    static const char *const members[][2] = {
        {"asset",
         "{\"version\":\"2.0\",\"generator\":\"a test\",\"extras\":{\"x\":\"\\u00e4\\u0001\\\"\\\\\"}}"},
        {"extensionsUsed", "[\"KHR_lights_punctual\",\"EXT_mesh_gpu_instancing\",\"KHR_materials_variants\","
                           "\"VENDOR_sound\",\"KHR_texture_transform\"]"},
        {"extensions",
         "{\"KHR_lights_punctual\":{\"lights\":[{\"type\":\"point\",\"intensity\":12.75}]},\"KHR_materials_"
         "variants\":{\"variants\":[{\"name\":\"day\"},{\"name\":\"night\"}]},\"VENDOR_sound\":{\"deep\":[1,"
         "2.5e-7,{\"a\":null,\"b\":true,\"c\":123456789012345}]}}"},
        {"extras", "{\"made\":\"here\"}"},
        {"cameras",
         "[{\"type\":\"perspective\",\"perspective\":{\"yfov\":0.7,\"znear\":0.1},\"extras\":[]}]"},
        {"images", "[{\"uri\":\"tile%20one.png\",\"name\":\"tile\"}]"},
        {"samplers", "[{\"wrapS\":10497}]"},
        {"textures", "[{\"source\":0,\"sampler\":0}]"},
        {"materials", "[{\"name\":\"tiles\",\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0,"
                      "\"extensions\":{\"KHR_texture_transform\":{\"scale\":[2,2]}}},\"roughnessFactor\":0.8}"
                      ",\"occlusionTexture\":{\"index\":0,\"strength\":0.5}},"
                      "{\"name\":\"leaf\",\"alphaMode\":\"MASK\",\"doubleSided\":true,\"extras\":{\"wind\":1}"
                      "},{\"name\":\"rail\",\"emissiveFactor\":[0.1,0.2,0.3]}]"},
    };
    for (size_t i = 0; i < COUNT_OF(members); ++i) {
        json_object_set_new(a->root, members[i][0], parsed(members[i][1]));
    }
}

/* Freed with free_asset(). */
static inline asset make_rich(void) {
    asset a = {json_object(), NULL, 0};
    rich_rest(&a);
    rich_meshes(&a);
    rich_nodes(&a);
    json_object_set_new(a.root, "buffers",
                        json_pack("[{s:I,s:s}]", "byteLength", (json_int_t)a.size, "name", "all"));
    return a;
}

/* An asset in the test's folder, its model, an atlas, and the asset with its light. */
typedef struct lighting {
    asset in, out;
    vsh_model *model;
    vsh_lit_mesh *lit;
} lighting;

static inline lighting begin_lighting(asset in, bool split) {
    lighting l = {.in = in};
    write_glb(&in, "in.glb");
    write_all(at("tile one.png"), white_png, sizeof white_png);
    l.model = model_from(at("in.glb"));
    l.lit = make_all_lit(l.model, split);
    return l;
}

static inline void light(lighting *l, const vsh_lit_options *options) {
    free_asset(&l->out);
    write_lit(at("in.glb"), l->model, l->lit, options, at("out.glb"));
    l->out = load_asset(at("out.glb"));
}

/* By one white image. */
static inline void light_white(lighting *l, int32_t purpose) {
    const vsh_lit_image image = white_image(purpose, 0);
    const vsh_lit_options options = options_of(&image, 1);
    light(l, &options);
}

static inline void end_lighting(lighting *l) {
    if (l->lit != NULL) {
        free_lit(l->lit, vsh_model_mesh_count(l->model));
    }
    vsh_model_free(l->model);
    free_asset(&l->in);
    free_asset(&l->out);
    unlink(at("out.glb"));
    remove_file("tile one.png");
    remove_file("in.glb");
}
