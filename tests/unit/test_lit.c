/* A lit asset is the asset with its light: all else comes back byte by byte. */
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
        for (size_t axis = 0; axis < 3; ++axis) {
            const double *m = mesh->transform + 4 * axis;
            t.place[3 * k + axis] = m[0] * (double)p[0] + m[1] * (double)p[1] + m[2] * (double)p[2] + m[3];
        }
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

/* What the output shows, read again: each triangle of the model where it was, with the UVs of the atlas. */
static void assert_shows(const char *path, const vsh_model *model, const vsh_lit_mesh *lit) {
    static triangle expected[4096], found[4096];
    OWNED(vsh_model) *again = read_model(path);
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
    for (size_t i = 0; i < sizeof paths / sizeof paths[0]; ++i) {
        OWNED(vsh_model) *model = read_model(paths[i]);
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
    assert_shows(path_of("out.glb").text, l.model, l.lit);
    /* the first mesh is used by two lit nodes, and by one elsewhere: it stays, and both have copies */
    assert_json_equal(item_of(&l.in, "meshes", 0), item_of(&l.out, "meshes", 0), "meshes[0]");
    json_t *made = json_pack("[i]", 1);
    for (size_t node = 1; node < 3; ++node) {
        const size_t mesh = number_of(item_of(&l.out, "nodes", node), "mesh");
        assert_true(mesh >= count_of(&l.in, "meshes"));
        json_t *copy = json_deep_copy(primitive_of(&l.out, mesh, 0));
        assert_int_equal(json_object_del(json_at(copy, "attributes"), "TEXCOORD_1"), 0);
        assert_json_equal(made, json_at(copy, "extras/vdbshade_uv_sets"), "sets that were made");
        assert_int_equal(json_object_del(json_at(copy, "extras"), "vdbshade_uv_sets"), 0);
        static const char *const kept[] = {"attributes", "extras", "indices", "targets"};
        for (size_t k = 0; k < sizeof kept / sizeof kept[0]; ++k) {
            assert_json_equal(json_object_get(primitive_of(&l.in, 0, 0), kept[k]), json_at(copy, kept[k]),
                              kept[k]);
        }
        json_decref(copy);
    }
    json_decref(made);
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
    assert_shows(path_of("out.glb").text, l.model, l.lit);
    const json_t *old = primitive_of(&l.in, 0, 0);
    const json_t *left = primitive_of(&l.out, number_of(item_of(&l.out, "nodes", 1), "mesh"), 0);
    const json_t *right = primitive_of(&l.out, number_of(item_of(&l.out, "nodes", 2), "mesh"), 0);
    for (size_t i = 0; i < sizeof attributes / sizeof attributes[0]; ++i) {
        const size_t to = attribute_of(left, attributes[i].name);
        assert_gathered(&l, attribute_of(old, attributes[i].name), to, attributes[i].size);
        assert_int_equal(attribute_of(right, attributes[i].name), to); /* shared, whoever shows it */
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
static void assert_same_floats(const asset *in, const asset *out, size_t accessor, size_t components) {
    assert_json_equal(json_object_get(item_of(in, "accessors", accessor), "type"),
                      json_object_get(item_of(out, "accessors", accessor), "type"), "its type");
    const size_t size = components * sizeof(float);
    for (size_t i = 0; i < number_of(item_of(in, "accessors", accessor), "count"); ++i) {
        assert_memory_equal(element_of(in, accessor, i, size), element_of(out, accessor, i, size), size);
    }
}

/* Bytes that only replaced vertices had are dropped, where no extension is unknown that may refer to them; no
 * index of what stays changes. */
TEST(replaced_vertices_are_dropped_where_nobody_else_can_use_them) {
    size_t sizes[2], accessors[2], image_view = 0;
    for (int known = 0; known < 2; ++known) {
        asset in = make_rich();
        json_array_set_new(list_of(&in, "nodes"), 8, parsed("{\"name\":\"empty\"}"));
        if (known) {
            json_object_del(json_at(in.root, "nodes/1"), "extensions");
            json_object_del(json_at(in.root, "extensions"), "VENDOR_sound");
            /* an image in the middle of colours: they go, it stays */
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
        assert_ok(vsh_lit_write(path_of("in.glb").text, l.model, l.lit, &options, path_of("out.glb").text,
                                NULL, &failure));
        l.out = load_asset(path_of("out.glb").text);
        assert_shows(path_of("out.glb").text, l.model, l.lit);
        assert_json_equal(json_at(in.root, "animations"), json_at(l.out.root, "animations"), "animations");
        assert_json_equal(json_at(in.root, "skins"), json_at(l.out.root, "skins"), "skins");
        for (size_t k = 0; k < 2; ++k) {
            const json_t *sampler =
                json_at(in.root, k == 0 ? "animations/0/samplers/0" : "animations/0/samplers/1");
            assert_same_floats(&in, &l.out, number_of(sampler, "input"), 1);
            assert_same_floats(&in, &l.out, number_of(sampler, "output"), k == 0 ? 3 : 1);
        }
        assert_same_floats(&in, &l.out, number_of(item_of(&in, "skins", 0), "inverseBindMatrices"), 16);
        /* points are not lit: their positions are where they were */
        assert_json_equal(primitive_of(&in, 3, 1), primitive_of(&l.out, 3, 1), "points");
        assert_same_floats(&in, &l.out, attribute_of(primitive_of(&in, 3, 1), "POSITION"), 3);
        if (known) {
            assert_int_equal(number_of(item_of(&l.out, "images", 1), "bufferView"), image_view);
            assert_memory_equal(bytes_of_view(&l.out, image_view), bytes_of_view(&in, image_view), 30);
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
    char *used = json_dumps(json_at(l.out.root, "extensionsUsed"), 0);
    assert_null(strstr(used, "\"EXT_mesh_gpu_instancing\""));
    free(used);
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
            charts[t] = t == 5 ? VSH_LIT_NO_CHART : (uint32_t)(t / 2 % 2);
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
        assert_shows(path_of("out.glb").text, l.model, l.lit);
        const size_t mesh = number_of(item_of(&l.out, "nodes", 1), "mesh");
        assert_int_equal(json_array_size(json_object_get(item_of(&l.out, "meshes", mesh), "primitives")), 2);
        size_t textures[2], triangles = 0;
        for (size_t p = 0; p < 2; ++p) {
            const json_t *primitive = primitive_of(&l.out, mesh, p);
            const json_t *material = item_of(&l.out, "materials", number_of(primitive, "material"));
            const json_t *info = json_object_get(json_object_get(material, "extensions"), "MOZ_lightmap");
            assert_string_equal(json_string_value(json_object_get(material, "name")), "tiles");
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
    for (size_t i = 0; i < 2 * sizeof paths / sizeof paths[0]; ++i) {
        vsh_model *model = read_model(paths[i / 2]);
        vsh_lit_mesh *lit = make_all_lit(model, i % 2 != 0);
        write_lit(paths[i / 2], model, lit, &options, path_of("out.glb").text);
        assert_shows(path_of("out.glb").text, model, lit);
        vsh_model *again = read_model(path_of("out.glb").text);
        assert_int_equal(vsh_model_mesh_count(again), vsh_model_mesh_count(model));
        for (size_t m = 0; m < vsh_model_mesh_count(model); ++m) {
            const vsh_mesh one = vsh_model_mesh(model, m, 0), other = vsh_model_mesh(again, m, 0);
            assert_int_equal(vsh_model_uv_sets(again, m), (one.uvs != NULL) + 1);
            assert_int_equal(one.normals != NULL, other.normals != NULL);
            assert_int_equal(one.object, other.object);
        }
        vsh_model_free(again);
        free_lit(lit, vsh_model_mesh_count(model));
        vsh_model_free(model);
        remove_file("out.glb");
    }
}

TEST(compressed_primitives_that_change_are_written_plain) {
    static const char path[] = VSH_MODELS "/scene_draco.glb";
    const vsh_lit_image image = white_image(VSH_LIT_OCCLUSION, 0);
    const vsh_lit_options options = options_of(&image, 1);
    OWNED(vsh_model) *model = read_model(path);
    for (int split = 0; split < 2; ++split) {
        vsh_lit_mesh *lit = make_all_lit(model, split != 0);
        write_lit(path, model, lit, &options, path_of("out.glb").text);
        assert_shows(path_of("out.glb").text, model, lit);
        asset out = load_asset(path_of("out.glb").text);
        char *text = json_dumps(out.root, 0);
        assert_null(strstr(text, "draco"));
        free(text);
        free_asset(&out);
        free_lit(lit, vsh_model_mesh_count(model));
        remove_file("out.glb");
    }
}

FIXTURE(make_folder, remove_folder)
