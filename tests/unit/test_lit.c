/* A lit asset is the asset with its light: everything else stays, byte by byte. */
#include "base/elementary.h"
#include "rich_asset.h"
#include "testing.h"

/* Another test looks at the only node that shows instances. */
static void forget_instances(lighting *l) {
    enum { MANY = 7 };
    json_t *const nodes[] = {json_array_get(list_of(&l->in, "nodes"), MANY),
                             json_array_get(list_of(&l->out, "nodes"), MANY)};
    for (int i = 0; i < 2; ++i) {
        json_object_del(nodes[i], "children");
        json_object_del(nodes[i], "extensions");
    }
}

/* --- triangles */

typedef struct triangle {
    double place[9], uv[6];
} triangle;

static triangle triangle_of(const vsh_mesh *mesh, const float *uvs, const uint32_t *corners_of) {
    triangle t;
    for (size_t k = 0; k < 3; ++k) {
        const float *p = mesh->positions + 3 * (size_t)mesh->indices[corners_of[k]];
        const vshi_vec place = vshi_transform_point(mesh->transform, vshi_vec_off(p));
        memcpy(t.place + 3 * k, &place, sizeof place);
        t.uv[2 * k] = (double)uvs[2 * k];
        t.uv[2 * k + 1] = (double)uvs[2 * k + 1];
    }
    return t;
}

static bool is_near(const triangle *a, const triangle *b) {
    double most = 0.0;
    for (int i = 0; i < 9; ++i) {
        most = fmax(most, fabs(a->place[i] - b->place[i]) / 10.0);
    }
    for (int i = 0; i < 6; ++i) {
        most = fmax(most, fabs(a->uv[i] - b->uv[i]));
    }
    return most < 1e-5;
}

static size_t list_triangles(const vsh_model *model, const vsh_lit_mesh *lit, int32_t set, triangle *list) {
    size_t count = 0;
    for (size_t m = 0; m < vsh_model_mesh_count(model); ++m) {
        const int32_t own = set >= 0 ? set : vsh_model_uv_sets(model, m) - 1;
        const vsh_mesh mesh = vsh_model_mesh(model, m, own);
        for (uint32_t t = 0; t < mesh.triangle_count; ++t) {
            float uvs[6];
            const uint32_t at[3] = {3 * t, 3 * t + 1, 3 * t + 2};
            for (size_t k = 0; k < 3; ++k) {
                const float *from = lit != NULL ? lit[m].uvs + 2 * (size_t)lit[m].indices[at[k]]
                                                : mesh.uvs + 2 * (size_t)mesh.indices[at[k]];
                memcpy(uvs + 2 * k, from, sizeof(float[2]));
            }
            list[count++] = triangle_of(&mesh, uvs, at);
        }
    }
    return count;
}

/* The output shows each triangle of the model where it was, with the UVs of the atlas. */
static void assert_shows(const char *path, const vsh_model *model, const vsh_lit_mesh *lit) {
    static triangle expected[4096], found[4096];
    OWNED(vsh_model) *again = model_from(path);
    const size_t count = list_triangles(model, lit, -1, expected);
    assert_int_equal(list_triangles(again, NULL, -1, found), count);
    for (size_t i = 0; i < count; ++i) {
        size_t k = 0;
        while (k < count && !is_near(&expected[i], &found[k])) {
            ++k;
        }
        assert_that(k != count, "%s: triangle %zu at (%g, %g, %g) with (%g, %g) is not there", path, i,
                    expected[i].place[0], expected[i].place[1], expected[i].place[2], expected[i].uv[0],
                    expected[i].uv[1]);
        found[k].uv[0] = INFINITY; /* each once */
    }
}

/* --- tests */

/* tests/models as they are, and the rich one. */
TEST(lit_by_their_own_uvs_files_change_in_their_materials_alone) {
    static const char *const paths[] = {VSH_MODELS "/scene.glb", VSH_MODELS "/figure.glb",
                                        VSH_MODELS "/scene.gltf", VSH_MODELS "/scene_draco.glb"};
    const vsh_lit_image image = white_image(VSH_LIT_OCCLUSION, 0);
    const vsh_lit_options options = options_of(&image, 1);
    for (size_t i = 0; i < COUNT_OF(paths); ++i) {
        OWNED(vsh_model) *model = model_from(paths[i]);
        FREED_BY(free_asset)
        asset in = load_asset(paths[i]), out = light_model(paths[i], model, NULL, &options);
        assert_kept(&in, &out, "", "occlusionTexture");
        for (size_t m = 0; m < count_of(&in, "meshes"); ++m) { /* some get a white material */
            assert_alike_but(primitive_of(&in, m, 0), primitive_of(&out, m, 0), "material", "a primitive");
        }
    }
}

TEST(new_uvs_leave_all_other_accessors_alone) {
    FREED_BY(end_lighting) lighting l = begin_lighting(make_rich(), false);
    light_white(&l, VSH_LIT_OCCLUSION);
    forget_instances(&l);
    assert_kept(&l.in, &l.out, "mesh", "occlusionTexture");
    assert_shows(at("out.glb"), l.model, l.lit);
    /* the first mesh is used by two lit nodes, and by one elsewhere: it stays, and both have copies */
    assert_json_equal(item_of(&l.in, "meshes", 0), item_of(&l.out, "meshes", 0), "meshes[0]");
    for (size_t node = 1; node < 3; ++node) {
        const size_t mesh = number_of(item_of(&l.out, "nodes", node), "mesh");
        assert_true(mesh >= count_of(&l.in, "meshes"));
        json_t *copy = json_deep_copy(primitive_of(&l.out, mesh, 0));
        assert_int_equal(json_object_del(json_at(copy, "attributes"), "TEXCOORD_1"), 0);
        static const char *const kept[] = {"attributes", "extras", "indices", "targets"};
        for (size_t k = 0; k < COUNT_OF(kept); ++k) {
            assert_json_equal(json_object_get(primitive_of(&l.in, 0, 0), kept[k]), json_at(copy, kept[k]),
                              kept[k]);
        }
        json_decref(copy);
    }
    /* one user: it changes where it is; strips stay strips */
    assert_int_equal(number_of(item_of(&l.out, "nodes", 3), "mesh"), 1);
    assert_true(attribute_of(primitive_of(&l.out, 1, 0), "TEXCOORD_0") >= count_of(&l.in, "accessors"));
    assert_int_equal(number_of(primitive_of(&l.out, 3, 0), "mode"), 5);
    assert_json_equal(primitive_of(&l.in, 3, 1), primitive_of(&l.out, 3, 1), "points");
}

/* Element i of the new accessor is that of the old one which the atlas says, byte by byte. */
static void assert_gathered(const lighting *l, size_t from, size_t to, size_t size) {
    assert_alike_but(item_of(&l->in, "accessors", from), item_of(&l->out, "accessors", to),
                     "bufferView byteOffset count min max sparse", "an accessor");
    assert_int_equal(number_of(item_of(&l->out, "accessors", to), "count"), l->lit[0].vertex_count);
    for (size_t i = 0; i < l->lit[0].vertex_count; ++i) {
        assert_memory_equal(element_of(&l->out, to, i, (size + 3) & ~(size_t)3),
                            element_of(&l->in, from, l->lit[0].sources[i], size), size);
    }
}

TEST(split_vertices_take_all_their_attributes_along) {
    static const struct {
        const char *name;
        size_t size;
    } attributes[] = {{"POSITION", 12}, {"NORMAL", 12}, {"TEXCOORD_0", 4}, {"COLOR_0", 3}, {"_ID", 2}};
    FREED_BY(end_lighting) lighting l = begin_lighting(make_rich(), true);
    light_white(&l, VSH_LIT_OCCLUSION);
    forget_instances(&l);
    assert_kept(&l.in, &l.out, "mesh", "occlusionTexture");
    assert_shows(at("out.glb"), l.model, l.lit);
    const json_t *old = primitive_of(&l.in, 0, 0);
    const json_t *left = primitive_of(&l.out, number_of(item_of(&l.out, "nodes", 1), "mesh"), 0);
    const json_t *right = primitive_of(&l.out, number_of(item_of(&l.out, "nodes", 2), "mesh"), 0);
    for (size_t i = 0; i < COUNT_OF(attributes); ++i) {
        const size_t to = attribute_of(left, attributes[i].name);
        assert_gathered(&l, attribute_of(old, attributes[i].name), to, attributes[i].size);
        assert_int_equal(attribute_of(right, attributes[i].name), to); /* both nodes share it */
    }
    assert_true(attribute_of(left, "TEXCOORD_1") != attribute_of(right, "TEXCOORD_1"));
    assert_int_equal(number_of(left, "indices"), number_of(right, "indices"));
    /* morph targets: a dense one as it is, a sparse one made dense */
    const json_t *target = json_array_get(json_object_get(old, "targets"), 0);
    const json_t *turned = json_array_get(json_object_get(left, "targets"), 0);
    assert_gathered(&l, number_of(target, "NORMAL"), number_of(turned, "NORMAL"), 12);
    for (size_t i = 0; i < l.lit[0].vertex_count; ++i) {
        const uint32_t source = l.lit[0].sources[i];
        const float expected = source == 3 ? 1.0F : source == 4 ? 2.0F : source == 20 ? 0.5F : 0.0F;
        const float move[3] = {0.0F, expected, 0.0F};
        assert_memory_equal(element_of(&l.out, number_of(turned, "POSITION"), i, 12), move, sizeof move);
    }
    /* joints and weights of the skinned one, and the strip as a list */
    const json_t *skinned = primitive_of(&l.out, number_of(item_of(&l.out, "nodes", 3), "mesh"), 0);
    const json_t *bare = primitive_of(&l.in, 1, 0);
    assert_gathered(&l, attribute_of(bare, "WEIGHTS_0"), attribute_of(skinned, "WEIGHTS_0"), 16);
    assert_gathered(&l, attribute_of(bare, "JOINTS_0"), attribute_of(skinned, "JOINTS_0"), 4);
    assert_null(json_object_get(primitive_of(&l.out, 3, 0), "mode"));
}

/* Floats that an animation or a skin refers to. */
static void assert_same_floats(const asset *in, size_t from, const asset *out, size_t to, size_t components) {
    assert_json_equal(json_object_get(item_of(in, "accessors", from), "type"),
                      json_object_get(item_of(out, "accessors", to), "type"), "its type");
    const size_t size = components * sizeof(float);
    for (size_t i = 0; i < number_of(item_of(in, "accessors", from), "count"); ++i) {
        assert_memory_equal(element_of(in, from, i, size), element_of(out, to, i, size), size);
    }
}

/* Bytes of replaced vertices alone are dropped, unless an unknown extension may refer to them. */
TEST(replaced_vertices_are_dropped_where_nobody_else_can_use_them) {
    size_t sizes[2], accessors[2], image_view = 0;
    for (int known = 0; known < 2; ++known) {
        asset in = make_rich();
        json_array_set_new(list_of(&in, "nodes"), 8, parsed("{\"name\":\"empty\"}"));
        if (known) {
            json_object_del(json_at(in.root, "nodes/1"), "extensions");
            json_object_del(json_at(in.root, "extensions"), "VENDOR_sound");
            /* an image between bytes of colours: these go, the image stays */
            const json_t *colors =
                item_of(&in, "bufferViews", number_of(item_of(&in, "accessors", 3), "bufferView"));
            json_t *within = json_pack("{s:i,s:I,s:i}", "buffer", 0, "byteOffset",
                                       (json_int_t)number_of(colors, "byteOffset") + 20, "byteLength", 30);
            image_view = (size_t)put_item(&in, "bufferViews", within);
            put_item(&in, "images",
                     json_pack("{s:I,s:s}", "bufferView", (json_int_t)image_view, "mimeType", "image/png"));
        }
        FREED_BY(end_lighting) lighting l = begin_lighting(in, true);
        const vsh_lit_image image = white_image(VSH_LIT_OCCLUSION, 0);
        const vsh_lit_options options = options_of(&image, 1);
        /* not by light_white(), which keeps it for validators: the image is none */
        assert_ok(vsh_lit_write(at("in.glb"), l.model, l.lit, &options, at("out.glb"), NULL, &failure));
        l.out = load_asset(at("out.glb"));
        assert_shows(at("out.glb"), l.model, l.lit);
        for (size_t k = 0; k < 2; ++k) {
            char path[64];
            snprintf(path, sizeof path, "animations/0/samplers/%zu", k);
            const json_t *sampler = json_at(in.root, path), *again = json_at(l.out.root, path);
            assert_same_floats(&in, number_of(sampler, "input"), &l.out, number_of(again, "input"), 1);
            assert_same_floats(&in, number_of(sampler, "output"), &l.out, number_of(again, "output"),
                               k == 0 ? 3 : 1);
        }
        static const char matrices[] = "inverseBindMatrices";
        assert_same_floats(&in, number_of(item_of(&in, "skins", 0), matrices), &l.out,
                           number_of(item_of(&l.out, "skins", 0), matrices), 16);
        /* points are not lit: their positions stay */
        assert_same_floats(&in, attribute_of(primitive_of(&in, 3, 1), "POSITION"), &l.out,
                           attribute_of(primitive_of(&l.out, 3, 1), "POSITION"), 3);
        if (known) {
            const size_t view = number_of(item_of(&l.out, "images", 1), "bufferView");
            assert_memory_equal(bytes_of_view(&l.out, view), bytes_of_view(&in, image_view), 30);
        }
        sizes[known] = l.out.size;
        accessors[known] = count_of(&l.out, "accessors");
    }
    /* UVs, colours, numbers, joints and weights, four lists of indices, a target of two, two of instances */
    assert_int_equal(accessors[0] - accessors[1], 1 + 1 + 1 + 2 + 4 + 2 + 2);
    assert_in_range(sizes[0] - sizes[1], VERTICES * (4 + 4 + 4 + 16 + 12) - 30 - 2 * 8, VERTICES * 100);
}

TEST(instances_become_nodes_where_their_uvs_differ) {
    FREED_BY(end_lighting) lighting l = begin_lighting(make_rich(), false);
    light_white(&l, VSH_LIT_OCCLUSION);
    const json_t *many = item_of(&l.out, "nodes", 7);
    assert_null(json_object_get(many, "mesh"));
    assert_null(json_object_get(many, "extensions"));
    const json_t *children = json_object_get(many, "children");
    assert_int_equal(json_array_size(children), 3);
    for (size_t i = 0; i < 3; ++i) {
        const json_t *child =
            item_of(&l.out, "nodes", (size_t)json_integer_value(json_array_get(children, i)));
        char name[16];
        snprintf(name, sizeof name, "many[%zu]", i);
        assert_string_equal(json_string_value(json_object_get(child, "name")), name);
        const json_t *primitive = primitive_of(&l.out, number_of(child, "mesh"), 1);
        assert_int_equal(attribute_of(primitive, "POSITION"),
                         attribute_of(primitive_of(&l.in, 2, 1), "POSITION"));
        /* halves of one accessor agree, and so share their UVs */
        assert_int_not_equal(attribute_of(primitive, "TEXCOORD_1"),
                             attribute_of(primitive_of(&l.out, number_of(child, "mesh"), 0), "TEXCOORD_1"));
    }
    FREED char *used = json_dumps(json_at(l.out.root, "extensionsUsed"), 0);
    assert_null(strstr(used, "\"EXT_mesh_gpu_instancing\""));
    /* by the file's own UVs they stay instances */
    free_lit(l.lit, vsh_model_mesh_count(l.model));
    l.lit = NULL;
    light_white(&l, VSH_LIT_OCCLUSION);
    assert_kept(&l.in, &l.out, "mesh", "occlusionTexture");
}

/* Every other quad lies on a second page. */
static void put_on_pages(vsh_lit_mesh *lit, size_t count) {
    for (size_t m = 0; m < count; ++m) {
        uint32_t *charts = malloc(lit[m].triangle_count * sizeof *charts);
        for (size_t t = 0; t < lit[m].triangle_count; ++t) {
            charts[t] = t == 5 ? VSH_NO_CHART : (uint32_t)(t / 2 % 2);
        }
        lit[m].charts = charts;
    }
}

TEST(primitives_on_two_pages_become_two) {
    static const uint32_t pages[2] = {0, 1};
    for (int split = 0; split < 2; ++split) {
        FREED_BY(end_lighting) lighting l = begin_lighting(make_rich(), split != 0);
        put_on_pages(l.lit, vsh_model_mesh_count(l.model));
        const vsh_lit_image images[2] = {white_image(VSH_LIT_LIGHTMAP, 1), white_image(VSH_LIT_LIGHTMAP, 0)};
        vsh_lit_options options = options_of(images, 2);
        options.chart_pages = pages;
        options.chart_count = 2;
        light(&l, &options);
        forget_instances(&l);
        assert_kept(&l.in, &l.out, "mesh", "extensions");
        assert_shows(at("out.glb"), l.model, l.lit);
        const size_t mesh = number_of(item_of(&l.out, "nodes", 1), "mesh");
        assert_int_equal(json_array_size(json_object_get(item_of(&l.out, "meshes", mesh), "primitives")), 2);
        size_t textures[2], triangles = 0;
        for (size_t p = 0; p < 2; ++p) {
            const json_t *primitive = primitive_of(&l.out, mesh, p);
            const json_t *material = item_of(&l.out, "materials", number_of(primitive, "material"));
            const json_t *info = json_object_get(json_object_get(material, "extensions"), "MOZ_lightmap");
            assert_memory_equal(json_string_value(json_object_get(material, "name")), "tiles.", 6);
            assert_int_equal(number_of(info, "texCoord"), 1);
            textures[p] = number_of(item_of(&l.out, "textures", number_of(info, "index")), "source");
            triangles +=
                number_of(item_of(&l.out, "accessors", number_of(primitive, "indices")), "count") / 3;
            assert_int_equal(attribute_of(primitive, "TEXCOORD_1"),
                             attribute_of(primitive_of(&l.out, mesh, 0), "TEXCOORD_1"));
        }
        assert_true(textures[0] == textures[1] + 1); /* in the order that images were given in */
        assert_int_equal(triangles, 2 * QUADS);
    }
}

/* Documents of other formats keep all triangles, their places and the first set. The second set is new. */
TEST(other_formats_become_documents) {
    static const char *const paths[] = {VSH_MODELS "/scene.obj", VSH_MODELS "/scene.ply",
                                        VSH_MODELS "/scene.stl", VSH_MODELS "/scene.fbx",
                                        VSH_MODELS "/scene.dae", VSH_MODELS "/figure.fbx"};
    const vsh_lit_image image = white_image(VSH_LIT_PREVIEW, 0);
    const vsh_lit_options options = options_of(&image, 1);
    for (size_t i = 0; i < 2 * COUNT_OF(paths); ++i) {
        OWNED(vsh_model) *model = model_from(paths[i / 2]);
        vsh_lit_mesh *lit = make_all_lit(model, i % 2 != 0);
        write_lit(paths[i / 2], model, lit, &options, at("out.glb"));
        assert_shows(at("out.glb"), model, lit);
        OWNED(vsh_model) *again = model_from(at("out.glb"));
        assert_int_equal(vsh_model_mesh_count(again), vsh_model_mesh_count(model));
        for (size_t m = 0; m < vsh_model_mesh_count(model); ++m) {
            const vsh_mesh one = vsh_model_mesh(model, m, 0), other = vsh_model_mesh(again, m, 0);
            assert_int_equal(vsh_model_uv_sets(again, m), (one.uvs != NULL) + 1);
            assert_int_equal(one.normals != NULL, other.normals != NULL);
            assert_int_equal(one.object, other.object);
        }
        free_lit(lit, vsh_model_mesh_count(model));
        remove_file("out.glb");
    }
}

TEST(compressed_primitives_that_change_are_written_plain_by_a_reader_too) {
    static const char path[] = VSH_MODELS "/scene_draco.glb";
    const vsh_lit_image image = white_image(VSH_LIT_OCCLUSION, 0);
    const vsh_lit_options options = options_of(&image, 1);
    OWNED(vsh_model) *model = model_from(path);
    for (int split = 0; split < 2; ++split) {
        vsh_lit_mesh *lit = make_all_lit(model, split != 0);
        vsh_run run = vsh_run_default();
        run.reader = "/proc/self/exe";
        assert_ok(vsh_lit_write(path, model, lit, &options, at("out.glb"), &run, &failure));
        FREED_BY(free_asset) asset by_reader = load_asset(at("out.glb"));
        write_lit(path, model, lit, &options, at("out.glb"));
        assert_shows(at("out.glb"), model, lit);
        FREED_BY(free_asset) asset out = load_asset(at("out.glb"));
        FREED char *text = json_dumps(out.root, 0);
        assert_null(strstr(text, "draco"));
        assert_same_asset(&out, &by_reader);
        free_lit(lit, vsh_model_mesh_count(model));
        remove_file("out.glb");
    }
}

/* --- images and materials: what they hold, where they go, and who shares them */

enum { WIDTH = 7, HEIGHT = 3, TEXELS = WIDTH * HEIGHT };

/* The image of texture `texture`, which lies in the buffer, read again. */
static vsh_image_file *image_of(const asset *out, size_t texture) {
    const json_t *image = item_of(out, "images", number_of(item_of(out, "textures", texture), "source"));
    const size_t view = number_of(image, "bufferView");
    assert_string_equal(json_string_value(json_object_get(image, "mimeType")), "image/png");
    write_all(at("image.png"), bytes_of_view(out, view),
              number_of(item_of(out, "bufferViews", view), "byteLength"));
    vsh_image_file *file = NULL;
    assert_ok(vsh_image_read(at("image.png"), NULL, &file, &failure));
    remove_file("image.png");
    return file;
}

static void assert_values(const vsh_image_file *file, int32_t channel, const double *expected, double most) {
    const vsh_image image = vsh_image_view(file);
    assert_int_equal(image.width, WIDTH);
    assert_int_equal(image.height, HEIGHT);
    for (int i = 0; i < TEXELS; ++i) {
        const double error = fabs((double)image.planes[channel][i] - expected[i]);
        assert_that(error <= 0.5 / most + 1e-6, "channel %d, texel %d: %.9g, expected %.9g", channel, i,
                    (double)image.planes[channel][i], expected[i]);
    }
}

/* A scene's file, lit by its own UVs. */
static asset write_scene(const vsh_lit_image *images, size_t count) {
    static const char path[] = VSH_MODELS "/scene.glb";
    const vsh_lit_options options = options_of(images, count);
    OWNED(vsh_model) *model = model_from(path);
    asset out = light_model(path, model, NULL, &options);
    return out;
}

static vsh_lit_image image_with(int32_t purpose, const float *const *channels, int32_t count, int32_t bits,
                                double intensity) {
    return (vsh_lit_image){.purpose = purpose,
                           .width = WIDTH,
                           .height = HEIGHT,
                           .channels = channels,
                           .channel_count = count,
                           .bits = bits,
                           .intensity = intensity};
}

TEST(planes_become_images_of_their_values) {
    float planes[4][TEXELS]; /* one of grey, three of light up to 5.5 */
    double expected[4][TEXELS];
    for (int i = 0; i < TEXELS; ++i) {
        planes[0][i] = (float)i / (TEXELS - 1);
        expected[0][i] = (double)planes[0][i];
        for (int c = 1; c < 4; ++c) {
            planes[c][i] = (float)(i + c - 1) / 4.0F;
            expected[c][i] = (double)planes[c][i] / 5.5;
        }
    }
    const float *const views[4] = {planes[0], planes[1], planes[2], planes[3]};
    for (int32_t bits = 8; bits <= 16; bits += 8) {
        const double most = bits == 8 ? 255.0 : 65535.0;
        const vsh_lit_image images[2] = {image_with(VSH_LIT_OCCLUSION, views, 1, bits, 0.0),
                                         image_with(VSH_LIT_LIGHTMAP, views + 1, 3, bits, 2.0)};
        FREED_BY(free_asset) asset out = write_scene(images, 2);
        const json_t *lightmap = json_at(out.root, "materials/0/extensions/MOZ_lightmap");
        OWNED(vsh_image_file) *file =
            image_of(&out, number_of(json_at(out.root, "materials/0/occlusionTexture"), "index"));
        assert_values(file, 0, expected[0], most);
        /* light over 1 is in the intensity */
        assert_true(json_number_value(json_object_get(lightmap, "intensity")) == 2.0 * 5.5);
        OWNED(vsh_image_file) *lit = image_of(&out, number_of(lightmap, "index"));
        for (int c = 0; c < 3; ++c) {
            assert_values(lit, c, expected[1 + c], most);
        }
    }
}

TEST(previews_are_unlit_base_colour_of_srgb) {
    float grey[TEXELS];
    double expected[TEXELS];
    for (int i = 0; i < TEXELS; ++i) {
        grey[i] = i == 3 ? NAN : i == 4 ? -1.0F : 2.0F * (float)i / (TEXELS - 1);
        expected[i] = i == 3 || i == 4 ? 0.0 : vshi_to_srgb(fmin(0.75 * (double)grey[i], 1.0));
    }
    const float *const one[1] = {grey};
    const vsh_lit_image image = image_with(VSH_LIT_PREVIEW, one, 1, 0, 0.75);
    FREED_BY(free_asset) asset out = write_scene(&image, 1);
    assert_non_null(json_at(out.root, "materials/0/extensions/KHR_materials_unlit"));
    const json_t *base = json_at(out.root, "materials/0/pbrMetallicRoughness/baseColorTexture");
    assert_int_equal(number_of(base, "texCoord"), 1);
    OWNED(vsh_image_file) *file = image_of(&out, number_of(base, "index"));
    assert_values(file, 0, expected, 255.0);
}

/* --- materials */

TEST(materials_are_copied_only_where_needed) {
    FREED_BY(end_lighting) lighting l = begin_lighting(make_rich(), false);
    light_white(&l, VSH_LIT_OCCLUSION);
    /* Three materials as they were, because unlit primitives show them too. Copies: tiles for UV set 1, leaf
     * for sets 0 and 1, rail for set 0; and white for set 1. */
    assert_int_equal(count_of(&l.out, "materials"), 3 + 1 + 2 + 1 + 1);
    for (size_t m = 0; m < 3; ++m) { /* all are shown unlit as well */
        assert_json_equal(item_of(&l.in, "materials", m), item_of(&l.out, "materials", m), "a material");
    }
    /* left and right share theirs */
    size_t shared[2];
    for (size_t node = 1; node < 3; ++node) {
        const json_t *primitive = primitive_of(&l.out, number_of(item_of(&l.out, "nodes", node), "mesh"), 0);
        shared[node - 1] = number_of(primitive, "material");
        const json_t *variants =
            json_object_get(json_object_get(primitive, "extensions"), "KHR_materials_variants");
        const json_t *mappings = json_object_get(variants, "mappings");
        assert_int_equal(number_of(json_array_get(mappings, 0), "material"), shared[0]);
        const json_t *night =
            item_of(&l.out, "materials", number_of(json_array_get(mappings, 1), "material"));
        assert_string_equal(json_string_value(json_object_get(night, "name")), "leaf.4");
        assert_int_equal(number_of(json_object_get(night, "occlusionTexture"), "texCoord"), 1);
    }
    assert_int_equal(shared[0], shared[1]);
    /* without the other scene's node and the points, they change where they are */
    json_array_remove(list_of(&l.in, "scenes"), 1);
    json_array_set_new(list_of(&l.in, "nodes"), 8, parsed("{\"name\":\"empty\"}"));
    json_array_remove(json_at(l.in.root, "meshes/3/primitives"), 1);
    write_glb(&l.in, "in.glb");
    light_white(&l, VSH_LIT_OCCLUSION);
    assert_int_equal(count_of(&l.out, "materials"), 3 + 1 + 1);
    for (size_t m = 0; m < 3; ++m) {
        assert_non_null(json_object_get(item_of(&l.out, "materials", m), "occlusionTexture"));
    }
}

TEST(cut_out_materials_have_no_preview) {
    asset in = make_rich();
    set_at(&in, "materials/0", "alphaMode", json_string("MASK"));
    FREED_BY(end_lighting) lighting l = begin_lighting(in, false);
    light_white(&l, VSH_LIT_PREVIEW);
    for (size_t m = 0; m < count_of(&l.out, "materials"); ++m) {
        const json_t *material = item_of(&l.out, "materials", m);
        const char *name = json_string_value(json_object_get(material, "name"));
        if (name != NULL && strcmp(name, "tiles") == 0) {
            assert_json_equal(item_of(&in, "materials", 0), material, "tiles");
        }
    }
}

/* --- where they go */

TEST(images_go_beside_a_gltf_with_its_buffer) {
    static const uint32_t pages[2] = {0, 1};
    FREED_BY(end_lighting) lighting l = begin_lighting(make_rich(), false);
    l.lit[0].page = 1;
    const vsh_lit_image images[2] = {white_image(VSH_LIT_LIGHTMAP, 0), white_image(VSH_LIT_LIGHTMAP, 1)};
    vsh_lit_options options = options_of(images, 2);
    options.chart_pages = pages;
    options.chart_count = 2;
    write_lit(at("in.glb"), l.model, l.lit, &options, at("a b.gltf"));
    l.out = load_asset(at("a b.gltf"));
    assert_string_equal(text_at(&l.out, "buffers/0/uri"), "a%20b.bin");
    assert_string_equal(text_at(&l.out, "buffers/0/name"), "all");
    assert_string_equal(text_at(&l.out, "images/1/uri"), "a%20b.lightmap.0.png");
    assert_string_equal(text_at(&l.out, "images/2/uri"), "a%20b.lightmap.1.png");
    assert_views_kept(&l.in, &l.out);
    static const char *const written[] = {"a b.lightmap.0.png", "a b.lightmap.1.png"};
    for (size_t i = 0; i < 2; ++i) {
        assert_file(written[i], white_png, sizeof white_png);
        remove_file(written[i]);
    }
    /* and it can be read again */
    OWNED(vsh_model) *again = model_from(at("a b.gltf"));
    assert_int_equal(vsh_model_mesh_count(again), vsh_model_mesh_count(l.model));
    remove_file("a b.gltf");
    remove_file("a b.bin");
}

TEST(images_are_copied_into_another_folder) {
    asset in = make_rich();
    put_item(&in, "images", parsed("{\"uri\":\"gone.png\"}"));
    put_item(&in, "images", parsed("{\"uri\":\"link.png\"}"));
    put_item(&in, "images", parsed("{\"uri\":\"https://a.b/c.png\"}"));
    assert_int_equal(symlink("/etc/passwd", at("link.png")), 0);
    assert_int_equal(mkdir(at("other"), 0777), 0);
    FREED_BY(end_lighting) lighting l = begin_lighting(in, false);
    vsh_run run = vsh_run_default();
    run.warning = keep_warning;
    warnings[0] = '\0';
    assert_ok(vsh_lit_write(at("in.glb"), l.model, NULL, NULL, at("other/out.glb"), &run, &failure));
    l.out = load_asset(at("other/out.glb"));
    assert_null(text_at(&l.out, "images/0/uri"));
    assert_string_equal(text_at(&l.out, "images/0/name"), "tile");
    assert_memory_equal(bytes_of_view(&l.out, number_of(item_of(&l.out, "images", 0), "bufferView")),
                        white_png, sizeof white_png);
    for (size_t i = 1; i < 4; ++i) { /* images that cannot be read stay as they were */
        assert_json_equal(item_of(&in, "images", i), item_of(&l.out, "images", i), "an image");
    }
    assert_non_null(strstr(warnings, "gone.png"));
    assert_non_null(strstr(warnings, "outside of the model's folder"));
    remove_file("other/out.glb");
    assert_int_equal(rmdir(at("other")), 0);
    remove_file("link.png");
}

/* --- assets that are lit again: the next bake replaces what this one made, and nothing else */

enum { LIGHTMAP = 1 << VSH_LIT_LIGHTMAP, OCCLUSION = 1 << VSH_LIT_OCCLUSION };

/* A scene with a texture that it shows and one that it does not: the glass's. */
static asset make_scene(void) {
    asset a = load_asset(VSH_MODELS "/scene.glb");
    for (int i = 0; i < 2; ++i) {
        const int view = put_view(&a, white_png, sizeof white_png, 0, 0);
        put_item(&a, "images", json_pack("{s:i,s:s}", "bufferView", view, "mimeType", "image/png"));
    }
    put_item(&a, "samplers", parsed("{\"wrapS\":10497}"));
    put_item(&a, "textures", parsed("{\"source\":0,\"sampler\":0}"));
    put_item(&a, "textures", parsed("{\"source\":1}"));
    set_at(&a, "materials/1", "occlusionTexture", parsed("{\"index\":0}"));
    set_at(&a, "buffers/0", "byteLength", json_integer((json_int_t)a.size));
    return a;
}

/* Lights an asset, whose first object is on the last page, by white images of these purposes. */
static asset light_again(const asset *in, int purposes, uint32_t pages) {
    write_glb(in, "in.glb");
    OWNED(vsh_model) *model = model_from(at("in.glb"));
    vsh_lit_mesh *lit = make_all_lit(model, true);
    lit[0].page = pages - 1;
    vsh_lit_image images[4];
    size_t count = 0;
    for (int purpose = 0; purpose <= VSH_LIT_PREVIEW; ++purpose) {
        for (uint32_t page = 0; page < pages && (purposes >> purpose & 1) != 0; ++page) {
            images[count++] = white_image(purpose, page);
        }
    }
    vsh_lit_options options = options_of(images, count);
    asset out = light_model(at("in.glb"), model, lit, &options);
    free_lit(lit, vsh_model_mesh_count(model));
    remove_file("in.glb");
    return out;
}

/* The scene's own textures, samplers and images are where they were. */
static void assert_own_kept(const asset *in, const asset *out) {
    assert_list_kept(in, out, "textures", "");
    assert_list_kept(in, out, "samplers", "");
    assert_list_kept(in, out, "images", "bufferView");
    for (size_t i = 0; i < 2; ++i) {
        const size_t view = number_of(item_of(out, "images", i), "bufferView");
        assert_memory_equal(bytes_of_view(out, view), white_png, sizeof white_png);
    }
}

static void assert_counts(const asset *a, const asset *b) {
    static const char *const lists[] = {"textures", "images", "samplers"};
    for (size_t k = 0; k < COUNT_OF(lists); ++k) {
        assert_int_equal(count_of(a, lists[k]), count_of(b, lists[k]));
    }
}

/* Every material leads to the texture, image and sampler of each purpose. */
static void assert_shown(const asset *out, int purposes) {
    static const struct {
        const char *name, *info;
    } shown[] = {[VSH_LIT_OCCLUSION] = {"occlusion", "occlusionTexture"},
                 [VSH_LIT_LIGHTMAP] = {"lightmap", "extensions/MOZ_lightmap"}};
    for (size_t m = 0; m < count_of(out, "materials"); ++m) {
        json_t *material = json_array_get(list_of(out, "materials"), m);
        for (int purpose = 0; purpose < 2; ++purpose) {
            if ((purposes >> purpose & 1) == 0) {
                continue;
            }
            const json_t *info = json_at(material, shown[purpose].info);
            const json_t *texture = item_of(out, "textures", number_of(info, "index"));
            const json_t *image = item_of(out, "images", number_of(texture, "source"));
            const json_t *sampler = item_of(out, "samplers", number_of(texture, "sampler"));
            assert_string_equal(json_string_value(json_object_get(image, "name")), shown[purpose].name);
            assert_int_equal(number_of(sampler, "wrapS"), 33071);
            assert_memory_equal(bytes_of_view(out, number_of(image, "bufferView")), white_png,
                                sizeof white_png);
        }
    }
}

TEST(fewer_pages_leave_fewer_textures) {
    FREED_BY(free_asset) asset in = make_scene(), two = light_again(&in, OCCLUSION | LIGHTMAP, 2);
    FREED_BY(free_asset) asset one = light_again(&in, OCCLUSION | LIGHTMAP, 1);
    assert_int_equal(count_of(&two, "textures"), 6);
    FREED_BY(free_asset)
    asset less = light_again(&two, OCCLUSION | LIGHTMAP, 1),
          more = light_again(&one, OCCLUSION | LIGHTMAP, 2);
    assert_counts(&less, &one);
    assert_counts(&more, &two);
    assert_own_kept(&in, &less);
    assert_own_kept(&in, &more);
    assert_shown(&less, OCCLUSION | LIGHTMAP);
    /* a lightmap that is not baked again stays, with what shows it */
    FREED_BY(free_asset) asset ao = light_again(&one, OCCLUSION, 1);
    assert_int_equal(count_of(&ao, "textures"), 4);
    assert_own_kept(&in, &ao);
    assert_shown(&ao, OCCLUSION | LIGHTMAP);
}

TEST(textures_of_others_stay) {
    FREED_BY(free_asset) asset in = make_scene(), one = light_again(&in, LIGHTMAP, 1);
    const json_int_t image = (json_int_t)number_of(item_of(&one, "textures", 2), "source");
    /* a stranger's, with the same image, which stays with it */
    put_item(&one, "extensionsUsed", json_string("EXT_texture_avif"));
    put_item(&one, "textures", json_pack("{s:{s:{s:I}}}", "extensions", "EXT_texture_avif", "source", image));
    FREED_BY(free_asset) asset two = light_again(&one, LIGHTMAP, 1);
    assert_int_equal(count_of(&two, "textures"), 4);
    assert_int_equal(count_of(&two, "images"), 4);
    assert_list_kept(&one, &two, "samplers", "");
    assert_json_equal(item_of(&one, "textures", 3), item_of(&two, "textures", 2), "a texture");
    assert_int_equal(number_of(item_of(&two, "textures", 3), "source"), image + 1);
    assert_shown(&two, LIGHTMAP);
    /* one whose mark is gone */
    json_object_del(json_at(two.root, "textures/3"), "extras");
    FREED_BY(free_asset) asset three = light_again(&two, LIGHTMAP, 1);
    assert_list_kept(&two, &three, "textures", "");
    assert_int_equal(count_of(&three, "textures"), 5);
}

TEST(beside_an_extension_that_is_not_known_all_stays) {
    FREED_BY(free_asset) asset in = make_scene(), one = light_again(&in, LIGHTMAP, 1);
    put_item(&one, "extensionsUsed", json_string("VENDOR_skylights"));
    set_at(&one, "", "extensions", parsed("{\"VENDOR_skylights\":{\"texture\":2}}"));
    FREED_BY(free_asset) asset two = light_again(&one, LIGHTMAP, 1);
    assert_list_kept(&one, &two, "textures", "");
    assert_list_kept(&one, &two, "images", "");
    assert_int_equal(count_of(&two, "textures"), count_of(&one, "textures") + 1);
}

FIXTURE(make_folder, remove_empty_folder)
