/* Scenes: what their keys become, and which scenes are refused: wrong, damaged, too large, not there. */
#include "base/error.h"
#include "fields.h"
#include "folder.h"
#include "io/reader/reader.h"
#include "scenes.h"
#include "shade/shade.h"
#include "testing.h"
#include <jansson.h>
#include <malloc.h>

static const double PI = 3.14159265358979323846;

static void assert_vector(const double *found, double x, double y, double z) {
    assert_near(found[0], x, 1e-14);
    assert_near(found[1], y, 1e-14);
    assert_near(found[2], z, 1e-14);
}

static void assert_point(const double *m, const double *p, double x, double y, double z) {
    const double q[3] = {
        m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + m[3],
        m[4] * p[0] + m[5] * p[1] + m[6] * p[2] + m[7],
        m[8] * p[0] + m[9] * p[1] + m[10] * p[2] + m[11],
    };
    assert_vector(q, x, y, z);
}

/* By distances on both sides of its surfaces. */
TEST(the_seeds_scene_is_the_one_of_the_techniques) {
    OWNED(vsh_scene) *scene = NULL;
    assert_ok(vsh_scene_read(seeds_path, NULL, &scene, &failure));
    assert_int_equal(scene->caster_count, 1);
    assert_int_equal(scene->casters[0].type, VSH_CASTER_SDF);
    uint64_t counter = 1;
    for (int i = 0; i < 20000; ++i) {
        const double p[3] = {between(&counter, -3.5, 3.5), between(&counter, -0.1, 2.2),
                             between(&counter, -3.5, 3.5)};
        const double truth = truth_distance(truth_seeds(), p),
                     found = vshi_sdf_distance(&scene->casters[0].sdf, p);
        /* inside of unions neither is the distance to the nearest surface */
        assert_true((found < 0.0) == (truth < 0.0));
        assert_near(fmax(found, 0.0), fmax(truth, 0.0), 1e-12);
    }
    assert_true(scene->grid.voxel_size == 0.02);
    assert_int_equal(scene->light_count, 1);
    assert_string_equal(scene->lights[0].name, "sun");
    assert_int_equal(scene->lights[0].type, VSH_LIGHT_DIRECTIONAL);
    assert_memory_equal(scene->lights[0].direction, truth_seeds_sun, sizeof truth_seeds_sun);
    assert_near(tan(scene->lights[0].angle / 2.0), truth_seeds_w, 1e-15);
    assert_int_equal(scene->receiver_count, 1);
    assert_string_equal(scene->receivers[0].path, VSH_ASSETS "/seeds_floor.obj");
    assert_string_equal(scene->receivers[0].output, VSH_ASSETS "/seeds.exr");
    assert_true(scene->receivers[0].width == 512 && scene->receivers[0].height == 512);
}

static const char full_scene[] =
    "{\"casters\": ["
    " {\"mesh\": \"a.glb\", \"transform\": {\"translate\": [1, 2, 3], \"rotate_deg\": [0, 90, 0],"
    "  \"scale\": [2, 3, 4]}},"
    " {\"vdb\": \"/data/b.vdb\", \"grid\": \"rock\", \"transform\": {\"matrix\":"
    "  [0, -1, 0, 5, 1, 0, 0, 6, 0, 0, 1, 7]}},"
    " {\"vdb\": \"../c.vdb\"},"
    " {\"sdf\": {\"op\": \"subtraction\", \"translate\": [9, 8, 7], \"scale\": 3, \"rotate_quat\": [0, 2, 0, "
    "2],"
    "  \"of\": [{\"op\": \"smooth_union\", \"smoothing\": 0.25, \"rotate_deg\": [90, 0, 0], \"of\": ["
    "   {\"shape\": \"capsule\", \"half_height\": 1.5, \"radius\": 0.75},"
    "   {\"shape\": \"cylinder\", \"half_height\": 2.5, \"radius\": 1.75},"
    "   {\"shape\": \"cone\", \"half_height\": 3.5, \"radius\": 2.75, \"top_radius\": 0.5}]},"
    "   {\"op\": \"intersection\", \"of\": [{\"shape\": \"cone\", \"half_height\": 1, \"radius\": 1},"
    "    {\"shape\": \"box\", \"half_size\": [1, 2, 3]}]}]},"
    "  \"transform\": {\"rotate_quat\": [0, 0, 1, 1], \"scale\": 0.5}},"
    " {\"mask\": \"m.png\", \"size\": [2, 3], \"thickness\": 0.5, \"channel\": \"red\", \"threshold\": 0.25,"
    "  \"invert\": true, \"transform\": {\"translate\": [1, 1, 1]}},"
    " {\"text\": \"a\\nb\", \"font\": \"f.ttf\", \"height\": 2, \"line_spacing\": 1.5, \"align\": \"right\","
    "  \"thickness\": 0.25}],"
    "\"resolution\": 64, \"half_width\": 4.5, \"shell_thickness\": 3,"
    "\"lights\": ["
    " {\"name\": \"sun\", \"type\": \"directional\", \"direction\": [0, 2, 0], \"color\": [3, 2, 1]},"
    " {\"name\": \"lamp\", \"type\": \"sphere\", \"position\": [1, 2, 3], \"radius\": 0.125,"
    "  \"falloff\": \"quadratic\", \"reach\": 12},"
    " {\"name\": \"head_-9\", \"type\": \"spot\", \"position\": [4, 5, 6], \"radius\": 0, \"direction\": [0, "
    "-1, 0],"
    "  \"inner_deg\": 30, \"outer_deg\": 180, \"falloff\": \"inverse_square\"}],"
    "\"ao\": {\"distance\": 2.5, \"method\": \"cones\", \"cones\": 32},"
    "\"rays\": 77, \"sampler\": \"blue\", \"frame\": 5, \"early_rays\": 4, \"max_error\": 0.25, \"error\": "
    "true,"
    "\"irradiance\": true, \"method\": \"smooth\", \"max_steps\": 99, \"start_offset\": 2.5,"
    "\"receivers\": ["
    " {\"mesh\": \"a.glb\", \"transform\": {\"translate\": [1, 0, 0]}, \"uv_set\": 1, \"size\": [128, 64],"
    "  \"supersample\": 2, \"padding\": 8, \"output\": \"out/a.png\", \"bits\": 16, \"pack\": \"R=ao\"},"
    " {\"mesh\": \"b.glb\", \"output\": \"b.exr\"}]}";

TEST(every_key_lands_in_its_field) {
    OWNED(vsh_scene) *scene = parse("dir/x/scene.json", full_scene);
    const double unit[3] = {1.0, 1.0, 1.0};
    /* `at` is where the caster's transform puts (1, 1, 1) */
    static const struct {
        int32_t type;
        const char *path;
        double at[3];
    } casters[] = {{VSH_CASTER_MESH, "dir/x/a.glb", {5.0, 5.0, 1.0}}, /* scaled by 2, 3, 4; z to x; moved */
                   {VSH_CASTER_VDB, "/data/b.vdb", {4.0, 7.0, 8.0}},
                   {VSH_CASTER_VDB, "dir/x/../c.vdb", {1.0, 1.0, 1.0}},
                   {VSH_CASTER_SDF, NULL, {-0.5, 0.5, 0.5}},
                   {VSH_CASTER_MASK, "dir/x/m.png", {2.0, 2.0, 2.0}},
                   {VSH_CASTER_TEXT, "dir/x/f.ttf", {1.0, 1.0, 1.0}}};
    const vsh_caster *c = scene->casters;
    assert_int_equal(scene->caster_count, 6);
    for (size_t i = 0; i < 6; ++i) {
        assert_int_equal(c[i].type, casters[i].type);
        assert_true(casters[i].path == NULL || strcmp(c[i].path, casters[i].path) == 0);
        assert_point(c[i].transform, unit, casters[i].at[0], casters[i].at[1], casters[i].at[2]);
    }
    assert_string_equal(c[1].grid, "rock");
    assert_null(c[2].grid);
    assert_true(c[4].mask.width == 2.0 && c[4].mask.height == 3.0 && c[4].thickness == 0.5);
    assert_true(c[4].mask.threshold == 0.25 && c[4].mask.invert != 0);
    assert_string_equal(c[4].mask.channel, "red");
    assert_string_equal(c[5].text, "a\nb");
    assert_true(c[5].letters.height == 2.0 && c[5].letters.line_spacing == 1.5 && c[5].thickness == 0.25);
    assert_int_equal(c[5].letters.align, VSH_ALIGN_RIGHT);

    static const struct {
        vsh_sdf_shape shape;
        int32_t left, right;
    } expected[] = {{VSH_SDF_CAPSULE, -1, -1}, {VSH_SDF_CYLINDER, -1, -1},   {VSH_SDF_SMOOTH_UNION, 0, 1},
                    {VSH_SDF_CONE, -1, -1},    {VSH_SDF_SMOOTH_UNION, 2, 3}, {VSH_SDF_CONE, -1, -1},
                    {VSH_SDF_BOX, -1, -1},     {VSH_SDF_INTERSECTION, 5, 6}, {VSH_SDF_SUBTRACTION, 4, 7}};
    const vsh_sdf_node *n = c[3].sdf.nodes;
    assert_int_equal(c[3].sdf.node_count, 9);
    for (size_t i = 0; i < 9; ++i) {
        assert_true(n[i].shape == expected[i].shape && n[i].left == expected[i].left &&
                    n[i].right == expected[i].right);
    }
    assert_true(n[0].size[1] == 1.5 && n[0].radius == 0.75 && n[1].size[1] == 2.5 && n[1].radius == 1.75);
    assert_true(n[2].smoothing == 0.25 && n[4].smoothing == 0.25 && n[5].minor_radius == 0.0);
    assert_true(n[3].size[1] == 3.5 && n[3].radius == 2.75 && n[3].minor_radius == 0.5);
    assert_vector(n[6].size, 1.0, 2.0, 3.0);
    assert_vector(n[2].rotation, 0.0, 0.0, 0.0); /* only the last of a fold is turned */
    assert_vector(n[4].rotation, sqrt(0.5), 0.0, 0.0);
    assert_near(n[4].rotation[3], sqrt(0.5), 1e-15);
    assert_vector(n[8].rotation, 0.0, 2.0, 0.0);
    assert_true(n[8].scale == 3.0 && n[7].scale == 1.0);
    assert_vector(n[8].translation, 9.0, 8.0, 7.0);

    const vsh_light *l = scene->lights;
    assert_int_equal(scene->light_count, 3);
    assert_vector(l[0].direction, 0.0, 2.0, 0.0);
    assert_vector(l[0].color, 3.0, 2.0, 1.0);
    assert_true(l[0].angle == vsh_light_default().angle);
    assert_true(l[1].type == VSH_LIGHT_SPHERE && l[1].radius == 0.125 && l[1].reach == 12.0);
    assert_vector(l[1].position, 1.0, 2.0, 3.0);
    assert_int_equal(l[1].falloff, VSH_FALLOFF_QUADRATIC);
    assert_vector(l[1].color, 1.0, 1.0, 1.0);
    assert_true(l[2].type == VSH_LIGHT_SPOT && l[2].falloff == VSH_FALLOFF_INVERSE_SQUARE);
    assert_string_equal(l[2].name, "head_-9");
    assert_vector(l[2].axis, 0.0, -1.0, 0.0);
    assert_vector(l[2].direction, 0.0, 1.0, 0.0); /* a sun's, as it was */
    assert_near(l[2].inner_angle, PI / 3.0, 1e-15);
    assert_true(l[2].outer_angle == 2.0 * PI);

    const vsh_grid_options *g = &scene->grid;
    assert_true(g->voxel_size == 0.0 && g->resolution == 64 && g->half_width == 4.5 &&
                g->shell_thickness == 3.0);
    const vsh_shade_options *o = &scene->shade;
    assert_true(scene->ao == 1 && scene->irradiance == 1 && scene->error);
    assert_true(o->ao_distance == 2.5 && o->ao_method == VSH_AO_CONES && o->ao_cones == 32);
    assert_true(o->method == VSH_SHADOW_SMOOTH && o->rays == 77 && o->sampler == VSH_SAMPLER_BLUE);
    assert_true(o->frame == 5 && o->early_rays == 4 && o->max_error == 0.25);
    assert_true(o->max_steps == 99 && o->start_offset == 2.5);

    const vsh_receiver *r = scene->receivers;
    assert_int_equal(scene->receiver_count, 2);
    assert_string_equal(r[0].path, "dir/x/a.glb");
    assert_string_equal(r[0].output, "dir/x/out/a.png");
    assert_string_equal(r[0].pack, "R=ao");
    assert_point(r[0].transform, unit, 2.0, 1.0, 1.0);
    assert_true(r[0].uv_set == 1 && r[0].width == 128 && r[0].height == 64 && r[0].supersample == 2);
    assert_true(r[0].padding == 8 && r[0].bits == 16);
}

TEST(missing_keys_have_the_defaults_of_the_headers) {
    OWNED(vsh_scene) *scene =
        parse("scene.json", "{\"casters\": [{\"mesh\": \"a.obj\"}],"
                            "\"receivers\": [{\"mesh\": \"a.obj\", \"output\": \"a.exr\"}]}");
    const vsh_grid_options grid = vsh_grid_options_default();
    const vsh_shade_options shade = vsh_shade_options_default();
    const vsh_lightmap_options lightmap = vsh_lightmap_options_default();
    const vsh_grid_options *g = &scene->grid; /* by its members: it has padding */
    assert_true(g->struct_size == grid.struct_size && g->voxel_size == grid.voxel_size);
    assert_true(g->resolution == grid.resolution && g->half_width == grid.half_width);
    assert_true(g->shell_thickness == grid.shell_thickness);
    assert_memory_equal(&scene->shade, &shade, sizeof shade);
    assert_true(!scene->ao && !scene->irradiance && scene->light_count == 0);
    assert_string_equal(scene->casters[0].path, "a.obj");
    const vsh_receiver *r = scene->receivers;
    assert_true(r->uv_set == -1 && r->bits == 0 && r->pack == NULL);
    assert_true(r->width == lightmap.width && r->height == lightmap.height);
    assert_true(r->supersample == lightmap.supersample && r->padding == lightmap.padding);
}

TEST(rotations_turn_about_x_then_y_then_z) {
    OWNED(vsh_scene) *scene =
        parse("s", "{\"casters\": [{\"mesh\": \"a\", \"transform\": {\"rotate_deg\": [90, 90, 0]}},"
                   "{\"mesh\": \"a\", \"transform\": {\"rotate_deg\": [0, 90, 90]}},"
                   "{\"mesh\": \"a\", \"transform\": {\"rotate_deg\": [370, -40, 725]}},"
                   "{\"mesh\": \"a\", \"transform\": {\"rotate_deg\": [10, 320, 5]}}]}");
    const double y[3] = {0.0, 1.0, 0.0}, x[3] = {1.0, 0.0, 0.0};
    assert_point(scene->casters[0].transform, y, 1.0, 0.0, 0.0);  /* y to z by x, z to x by y */
    assert_point(scene->casters[1].transform, x, 0.0, 0.0, -1.0); /* x to -z by y, which z leaves alone */
    for (int i = 0; i < 12; ++i) {                                /* whole turns change nothing */
        assert_near(scene->casters[2].transform[i], scene->casters[3].transform[i], 1e-14);
    }
}

TEST(a_rectangle_has_its_sides) {
    OWNED(vsh_scene) *scene =
        parse("a.json", "{\"casters\":[{\"sdf\":{\"shape\":\"sphere\",\"radius\":1}}],\"lights\":["
                        "{\"name\":\"a\",\"type\":\"rectangle\",\"position\":[1,2,3],"
                        "\"edge_u\":[4,0,0],\"edge_v\":[0,5,6],\"two_sided\":true},"
                        "{\"name\":\"b\",\"type\":\"rectangle\",\"position\":[1,2,3],"
                        "\"edge_u\":[0,1,0],\"edge_v\":[0,0,1]}]}");
    const vsh_light *l = scene->lights;
    assert_int_equal(l[0].type, VSH_LIGHT_RECTANGLE);
    assert_vector(l[0].position, 1.0, 2.0, 3.0);
    assert_vector(l[0].edge_u, 4.0, 0.0, 0.0);
    assert_vector(l[0].edge_v, 0.0, 5.0, 6.0);
    assert_true(l[0].two_sided == 1 && l[1].two_sided == 0);
}

/* --- scenes that are refused */

/* A scene around a part, and the part's place in it. */
static const struct frame {
    const char *before, *after, *place;
} bare = {"", "", ""},
  terrain = {"{'casters':[{'heightfield':'a','height':1,'size':[1,1],", "}]}", "casters[0]"},
  sun = {"{'casters':[{'mesh':'a'}],\n'lights':[{'name':'a','type':'directional','direction':[0,1,0],", "}]}",
         "lights[0]"},
  lamp = {"{'casters':[{'mesh':'a'}],\n'lights':[{'name':'a','type':'sphere','position':[0,0,0],", "}]}",
          "lights[0]"},
  layer = {"{'casters':[{'mesh':'a'}],\n'layers':[{'name':'a',", "}]}", "layers[0]"},
  mesh = {"{'casters':[{'mesh':'a',", "}]}", "casters[0]"},
  tree = {"{'casters':[{'sdf':", "}]}", "casters[0].sdf"},
  light = {"{'casters':[{'mesh':'a'}],\n'lights':[", "]}", "lights[0]"},
  receiver = {"{'casters':[{'mesh':'a'}],\n'receivers':[{'mesh':'m','output':'o'},", "]}", "receivers[1]"},
  caster = {"{'casters':[", "]}", "casters[0]"}, whole = {"{'casters':[{'mesh':'a'}],", "}", ""};

/* The @ stands before the place that the message names, and each ' for ". */
static const struct {
    const struct frame *around;
    const char *part;
    const char *message; /* behind the part's place; without an @, behind "s.json:" */
} bad[] = {
    /* not JSON */
    {&bare, "", "1:1: '[' or '{' expected near end of file"},
    {&bare, "{\n 'casters': [nope]}", "2:17: invalid token near 'nope'"},
    {&bare, "{'casters': 1,\n 'casters': 2}", "2:10: duplicate object key near '\"casters\"'"},
    {&bare, "{'voxel_size': 1e999}", "1:20: real number overflow near '1e999'"},
    {&bare, "{} {}", "1:4: end of file expected near '{'"},
    /* the whole */
    {&bare, "@[]", "expected an object, found an array"},
    {&bare, " @{}", "key \"casters\" is missing: a scene needs it"},
    {&bare, "{'casters':@[]}", "casters: has 0 items, out of range 1 … 65536"},
    {&bare, "{'casters':@{}}", "casters: expected an array, found an object"},
    {&bare, "{\n\t@'castors': []}", "castors: unknown key; did you mean \"casters\"?"},
    {&whole, "@'é':1,'xyzzy':1", "é: unknown key"},
    {&whole, "'method':@'ré','xyzzy':1",
     "method: \"ré\" is none of hard, classic, practical, improved, smooth, cone, rays, adaptive, exact, "
     "auto"},
    {&bare, "{'receivers':[],'\\u0061o':{'distance':1,@'cone':1}}",
     "ao.cone: unknown key; did you mean \"cones\"?"},
    {&whole, "'voxel_size':@0", "voxel_size: 0 is out of range 1e-12 … 1e+12"},
    {&whole, "'ao':{'distance':@5e-324}", "ao.distance: 4.94065646e-324 is out of range 1e-12 … 1e+15"},
    {&whole, "'voxel_size':@'1'", "voxel_size: expected a number, found a string"},
    {&whole, "'voxel_size':1,@'resolution':9", "resolution: cannot stand beside \"voxel_size\""},
    {&whole, "'resolution':@99999999999999999999", "resolution: 1e+20 is out of range 2 … 65536"},
    {&whole, "'resolution':@2.5", "resolution: 2.5 is not a whole number"},
    /* layers */
    {&whole, "\n'layers':[@{}]", "layers[0]: key \"name\" is missing: a layer needs it"},
    {&whole, "\n'layers':[{'name':'a'},{'name':@'a'}]", "layers[1].name: \"a\" is the name of layers[0] too"},
    {&layer, "'remap':@[0.5,0.5]", ".remap: expected two numbers that rise, found 0.5 and 0.5"},
    {&layer, "'softness':@-1", ".softness: -1 is out of range 0 … 1000"},
    {&layer, "'lights':[@'sun']", ".lights[0]: \"sun\" is none of the scene's lights"},
    {&mesh, "'layer':@'b'}],'layers':[{'name':'a'", ".layer: \"b\" is none of the scene's layers"},
    {&whole, "'irradiance':@1", "irradiance: expected true or false, found a number"},
    {&whole, "'ao':@{}", "ao: key \"distance\" is missing: ao needs it"},
    {&whole, "'ao':{@'cones':8,'method':'taps','distance':1}", "ao.cones: is no key of ao by taps"},
    /* casters */
    {&caster, "@{}",
     ": key \"mesh\", \"sdf\", \"vdb\", \"heightfield\", \"spheres\", \"mask\" or \"text\" is missing"},
    {&caster, "{'mask':'a','size':@0,'thickness':1}", ".size: 0 is out of range 0 (excluded) … 1e+15"},
    {&caster, "{'mask':'a','size':1,'thickness':@0}", ".thickness: 0 is out of range 0 (excluded) … 1e+15"},
    {&mesh, "@'thickness':1", ".thickness: is no key of a mesh caster"},
    {&caster, "@{'text':'a','thickness':1,'height':1}", ": key \"font\" is missing: a text caster needs it"},
    {&caster, "{'mesh':@''}", ".mesh: is empty"},
    {&caster, "{'vdb':'a',@'mesh':'a'}", ".mesh: cannot stand beside \"vdb\""},
    {&caster, "{'vdb':'a','transform':@{'scale':[1,1,2]}}",
     ".transform: shears or scales unevenly, which a vdb caster cannot"},
    {&mesh, "'transform':{'scale':@0}", ".transform.scale: 0 is out of range 1e-06 … 1000000"},
    {&mesh, "'transform':{'matrix':@[1,1,0,0,1,1,0,0,0,0,1,0]}",
     ".transform.matrix: flattens: the determinant of its first three columns is 0"},
    {&mesh, "'transform':{'matrix':@[1,0,0]}", ".transform.matrix: expected 12 numbers, found 3"},
    {&mesh, "'transform':{'rotate_quat':@[0,0,0,0]}",
     ".transform.rotate_quat: is zero, and so points nowhere"},
    {&mesh, "'transform':{'rotate_deg':[0,0,1],@'rotate_quat':[0,0,0,1]}",
     ".transform.rotate_quat: cannot stand beside \"rotate_deg\""},
    {&mesh, "'transform':{'matrix':[1,0,0,0,0,1,0,0,0,0,1,0],@'scale':2}",
     ".transform.scale: cannot stand beside \"matrix\""},
    {&mesh, "'transform':{'translate':[0,\n@'',0]}",
     ".transform.translate[1]: expected a number, found a string"},
    /* SDF trees */
    {&tree, "@{}", ": key \"shape\" or \"op\" is missing"},
    {&tree, "{'shape':@'cube'}",
     ".shape: \"cube\" is none of sphere, box, torus, plane, capsule, cylinder, cone"},
    {&tree, "{'op':'union',@'shape':'box'}", ".shape: cannot stand beside \"op\""},
    {&tree, "@{'shape':'sphere'}", ": key \"radius\" is missing: a sphere needs it"},
    {&tree, "{'shape':'sphere','radius':@0}", ".radius: 0 is out of range 0 (excluded) … 1e+15"},
    {&tree, "{'shape':'sphere','radius':1,@'rounding':1}", ".rounding: is no key of a sphere"},
    {&tree, "{'shape':'box','half_size':[1,1,@-1]}",
     ".half_size[2]: -1 is out of range 0 (excluded) … 1e+15"},
    {&tree, "{'shape':'plane','thickness':1,'half_size':@[1,1,1]}",
     ".half_size: expected 2 numbers, found 3"},
    {&tree, "@{'op':'union'}", ": key \"of\" is missing: a union needs it"},
    {&tree, "{'op':'union','of':@[{'shape':'sphere','radius':1}]}",
     ".of: has 1 items, out of range 2 … 65536"},
    {&tree, "{'op':'union','of':[{'shape':'sphere','radius':1},\n  {'shape':'sphere',\n@'radus':1}]}",
     ".of[1].radus: unknown key; did you mean \"radius\"?"},
    {&tree, "{'shape':'sphere','radius':1,'scale':@0}", ".scale: 0 is out of range 1e-06 … 1000000"},
    {&tree, "{'shape':'sphere','radius':1,'scale':@[1,1,1]}", ".scale: expected a number, found an array"},
    /* lights */
    {&sun, "'angle_deg':@180", ".angle_deg: 180 is out of range 0 … 180 (excluded)"},
    {&light, "{'name':'a','type':'directional','direction':@[0,0,-0.0]}",
     ".direction: is zero, and so points nowhere"},
    {&light, "{'name':'a','type':'directional',@'radius':1}", ".radius: is no key of a directional light"},
    {&light, "{'name':'a','type':@'sun'}", ".type: \"sun\" is none of directional, sphere, spot, rectangle"},
    {&light, "@{'type':'sphere','position':[0,0,0]}", ": key \"name\" is missing: a sphere light needs it"},
    {&light, "{'name':@'a b','type':'sphere'}",
     ".name: \"a b\" cannot name a light: expected 1 … 63 of A … Z, a … z, 0 … 9, _ and -"},
    {&whole,
     "\n'lights':[{'name':'a','type':'sphere','position':[0,0,0]},{'name':@'a','type':'sphere','position':[0,"
     "0,0]}]",
     "lights[1].name: \"a\" is the name of lights[0] too"},
    {&light, "@{'name':'a','type':'sphere','position':[0,0,0],'falloff':'quadratic'}",
     ": key \"reach\" is missing: falloff \"quadratic\" needs it"},
    {&lamp, "@'reach':1", ".reach: needs falloff \"quadratic\""},
    {&light, "{'name':'a','type':'spot','position':[0,0,0],'direction':[0,1,0],'inner_deg':@9,'outer_deg':8}",
     ".inner_deg: 9 is over outer_deg, 8"},
    {&lamp, "'color':[1,@-1,1]", ".color[1]: -1 is out of range 0 … 1e+15"},
    {&light, "@{'name':'a','type':'rectangle','position':[0,0,0],'edge_u':[1,0,0]}",
     ": key \"edge_v\" is missing: a rectangle light needs it"},
    {&light, "@{'name':'a','type':'rectangle','position':[0,0,0],'edge_u':[1,0,0],'edge_v':[1,1,0]}",
     ": light 'a': edge_u and edge_v are not at right angles: the cosine between them is 0.707106781, of at "
     "most 0.001"},
    /* heightfields */
    {&caster, "@{'heightfield':'a','height':1}",
     ": key \"extent\" is missing: a heightfield caster needs it"},
    {&caster, "{'heightfield':'a','height':1,'size':[1,@0]}", ".size[1]: 0 is out of range 1e-12 … 1e+12"},
    {&terrain, "'base':@0", ".base: 0 is out of range 0 (excluded) … 1e+12"},
    {&terrain, "@'voxelised':true", ".voxelised: is no key of a heightfield caster"},
    /* spheres */
    {&caster, "{'spheres':@7}", ".spheres: expected a file's name or an array of [x, y, z, radius]"},
    {&caster, "{'spheres':@[]}", ".spheres: is empty"},
    {&caster, "{'spheres':[[1,2,3,4],@[1,2,3]]}", ".spheres[1]: expected 4 numbers, found 3"},
    {&caster, "{'spheres':[[1,2,3,@-4]]}", ".spheres[0][3]: -4 is out of range 0 (excluded) … 1e+15"},
    {&caster, "{'spheres':[[1,2,@1e16,4]]}", ".spheres[0][2]: 1e+16 is out of range -1e+15 … 1e+15"},
    {&caster, "{'spheres':[[1,2,3,4]],'transform':@{'scale':[1,1,2]}}",
     ".transform: shears or scales unevenly, which a caster of spheres cannot"},
    {&receiver, "{'heightfield':'h',@'uv_set':0}", ".uv_set: is no key of a heightfield receiver"},
    {&receiver, "{'mesh':'m',@'plane':{}}", ".plane: cannot stand beside \"mesh\""},
    {&receiver, "{'plane':@{},'output':'p'}", ".plane: key \"size\" is missing: a plane needs it"},
    {&bare, "{'region':@[0,0,1,1]}", "region: belongs to flat scenes, which 'vdbshade flat' bakes"},
    /* receivers */
    {&receiver, "@{}", ": key \"mesh\" is missing: a receiver needs it"},
    {&receiver, "{'output':@'o','mesh':'m'}", ".output: \"o\" is the output of receivers[0] too"},
    {&receiver, "{'size':@0}", ".size: 0 is out of range 1 … 65536"},
    {&receiver, "{'size':@[1]}", ".size: expected 2 numbers, found 1"},
    {&receiver, "{'bits':@12}", ".bits: 12 is none of 0, 8, 16, 32"},
};

/* Takes the @ out of a text and writes quotes; the message then begins with the line and the column of the @.
 */
static void take_mark(char *text, const char *message, char *expected, size_t size) {
    char *mark = strchr(text, '@');
    int line = 1, column = 1;
    for (char *c = text; *c != '\0'; ++c) {
        *c = *c == '\'' ? '"' : *c;
        if (mark != NULL && c < mark) {
            column = *c == '\n' ? 1 : column + ((*c & 0xc0) != 0x80);
            line += *c == '\n';
        }
    }
    if (mark == NULL) {
        snprintf(expected, size, "s.json:%s", message);
    } else {
        memmove(mark, mark + 1, strlen(mark));
        snprintf(expected, size, "s.json:%d:%d: %s", line, column, message);
    }
}

TEST(errors_name_line_column_and_key) {
    size_t wrong = 0;
    for (size_t i = 0; i < COUNT_OF(bad); ++i) {
        const struct frame *f = bad[i].around;
        OWNED(vsh_scene) *scene = NULL;
        char text[512], message[512], expected[sizeof failure.message];
        snprintf(message, sizeof message, "%s%s", f->place, bad[i].message);
        assert_true(snprintf(text, sizeof text, "%s%s%s", f->before, bad[i].part, f->after) <
                    (int)sizeof text);
        take_mark(text, message, expected, sizeof expected);
        const vsh_result result = vshi_scene_parse("s.json", text, strlen(text), &scene, &failure);
        if (result != VSH_ERROR_INPUT || scene != NULL || strcmp(failure.message, expected) != 0) {
            print_error("%s\n  expected %s\n  found    %s\n", text, expected, failure.message);
            ++wrong;
        }
    }
    assert_int_equal(wrong, 0);
}

/* Parses text of any bytes; it must be refused with this in the message. */
static void assert_refused(const char *text, size_t size, const char *message) {
    vsh_scene *scene = NULL;
    assert_int_equal(vshi_scene_parse("s", text, size, &scene, &failure), VSH_ERROR_INPUT);
    assert_null(scene);
    assert_that(strncmp(failure.message, "s:", 2) == 0 && strstr(failure.message, message) != NULL &&
                    strpbrk(failure.message, "\r\n") == NULL,
                "'%s', expected '%s'", failure.message, message);
}

/* Jansson ends a number at a byte of 0, and reads on behind it. */
TEST(bytes_of_zero_are_refused_with_their_place) {
    static const char text[] = "{\"casters\": [],\n \"resolution\": 6\0, \"ck\": 0}";
    assert_refused(text, sizeof text - 1, "s:2:17: a byte of 0, expected text");
}

TEST(a_seeds_scene_cut_anywhere_is_an_error) {
    FREED unsigned char *bytes = NULL;
    read_all(seeds_path, &bytes);
    char *text = (char *)bytes;
    const size_t end = (size_t)(strrchr(text, '}') - text);
    for (size_t cut = 0; cut <= end; ++cut) {
        FREED char *piece =
            malloc(cut + 1); /* of just this size, so that a sanitizer sees a read behind it */
        assert_non_null(piece);
        memcpy(piece, text, cut);
        assert_refused(piece, cut, "");
    }
}

#define SPHERE "{\"shape\":\"sphere\",\"radius\":1}"

/* `head` and `tail` with `count` times `open` and then `close` between them, around a sphere. */
static char *repeated(const char *head, const char *open, const char *close, size_t count, const char *tail) {
    char *text = malloc(256 + count * (strlen(open) + strlen(close)));
    char *at = stpcpy(text, head);
    for (size_t i = 0; i < count; ++i) {
        at = stpcpy(at, open);
    }
    at = stpcpy(at, SPHERE);
    for (size_t i = 0; i < count; ++i) {
        at = stpcpy(at, close);
    }
    strcpy(at, tail);
    return text;
}

/* Each tree has the node count that is expected; 0: it is refused with the message. */
TEST(trees_nest_64_levels_and_have_65536_nodes) {
    static const char nest[] = "{\"casters\":[{\"sdf\":",
                      list[] = "{\"casters\":[{\"sdf\":{\"op\":\"union\",\"of\":[";
    static const struct {
        const char *head, *open, *close, *tail;
        size_t count, nodes;
        const char *message;
    } trees[] = {
        {nest, "{\"op\":\"union\",\"of\":[" SPHERE ",", "]}", "}]}", 63, 2 * 63 + 1, NULL},
        {nest, "{\"op\":\"union\",\"of\":[" SPHERE ",", "]}", "}]}", 64, 0, ""},
        {nest, "{\"op\":\"union\",\"of\":[" SPHERE ",", "]}", "}]}", 200, 0, ""},
        {nest, "{\"op\":\"union\",\"of\":[" SPHERE ",", "]}", "}]}", 1000, 0, ""},
        {nest, "{\"op\":\"union\",\"of\":[" SPHERE ",", "]}", "}]}", 5000, 0, ""},
        /* n leaves make 2 n - 1 nodes */
        {list, SPHERE ",", "", "]}}]}", 32767, 65535, NULL},
        {list, SPHERE ",", "", "]}}]}", 32768, 0,
         "of[32768]: is node 65537 of its tree, out of range 1 … 65536"},
    };
    for (size_t i = 0; i < COUNT_OF(trees); ++i) {
        FREED char *text =
            repeated(trees[i].head, trees[i].open, trees[i].close, trees[i].count, trees[i].tail);
        if (trees[i].nodes == 0) {
            assert_refused(text, strlen(text), trees[i].message);
        } else {
            OWNED(vsh_scene) *made = parse("s", text);
            assert_int_equal(made->casters[0].sdf.node_count, trees[i].nodes);
        }
    }
}

TEST(scales_of_nested_nodes_have_a_limit_together) {
    static const char text[] =
        "{\"casters\":[{\"sdf\":{\"op\":\"union\",\"scale\":1e6,\"of\":[{\"op\":\"union\",\"scale\":1e6,"
        "\"of\":["
        "{\"shape\":\"sphere\",\"radius\":1,\"scale\":1e6}," SPHERE "]}," SPHERE "]}}]}";
    assert_refused(text, sizeof text - 1, "casters[0].sdf.of[0].of[0]: the scales of all levels make 1e+18");
}

TEST(byte_order_marks_and_escapes_are_read) {
    OWNED(vsh_scene) *made = parse("s", "\xef\xbb\xbf{\"c\\u0061sters\":[{\"mesh\":\"\\\"\\\\\\u00e9\"}]}");
    assert_string_equal(made->casters[0].path, "\"\\é");
}

TEST(messages_stay_one_line_for_any_key) {
    char text[4096], key[2048];
    memset(key, 'k', sizeof key - 1);
    key[sizeof key - 1] = '\0';
    snprintf(text, sizeof text, "{\"casters\":[{\"mesh\":\"a\"}],\"a\\nb%s\":1}", key);
    assert_refused(text, strlen(text), "s:1:27: a?bkkk");
    assert_refused(text, strlen(text), "…: unknown key");
}

/* Otherwise the library would refuse a number of a scene file later, without line and key. */
TEST(the_library_accepts_all_values_that_the_table_of_keys_accepts) {
    const vshi_table tables[] = {vshi_scene_table, vshi_ao_table};
    size_t tried = 0;
    for (size_t t = 0; t < 2; ++t) {
        for (size_t k = 0; k < 2 * tables[t].key_count; ++k) {
            const vshi_key *key = &tables[t].keys[k / 2];
            const double value = k % 2 ? key->highest : key->lowest;
            vsh_scene made = vsh_scene_default();
            vsh_shade_options full;
            if (key->kind == VSHI_NUMBER) {
                *(double *)((char *)&made + key->offset) = value;
            } else if (key->kind == VSHI_INTEGER) {
                *(int32_t *)((char *)&made + key->offset) = (int32_t)value;
            } else {
                continue;
            }
            assert_int_equal(key->flags & (VSHI_ABOVE | VSHI_BELOW), 0);
            assert_that(vshi_shade_options_resolve(&made.shade, &full, &failure) == VSH_OK, "%s %g: %s",
                        key->name, value, failure.message);
            ++tried;
        }
    }
    assert_true(tried >= 20);
}

TEST(messages_replace_bytes_that_are_not_utf_8) {
    vshi_fail(&failure, VSH_ERROR_INPUT, "%s: type '%s' × %.4s", "caf\xe9.json", "\xff\xc0\x80 é", "abc…");
    assert_string_equal(failure.message, "caf?.json: type '??? é' × abc?");
}

TEST(files_that_cannot_be_read_are_refused) {
    const char *large = at("large.json");
    write_string(large, "");
    assert_int_equal(truncate(large, (off_t)1 << 36), 0);
    const struct {
        const char *path;
        vsh_result code;
        const char *message;
    } files[] = {
        {"/dev/zero", VSH_ERROR_READ, "/dev/zero: cannot be read: it is no regular file"},
        {large, VSH_ERROR_LIMIT, ": is larger than the 67108864 bytes that such a file may have"},
    };
    for (size_t i = 0; i < COUNT_OF(files); ++i) {
        vsh_scene *made = NULL;
        assert_int_equal(vsh_scene_read(files[i].path, NULL, &made, &failure), files[i].code);
        assert_null(made);
        assert_non_null(strstr(failure.message, files[i].message));
    }
}

/* --- the memory of reading a scene's text is known before it is read */

/* An array of `count` times a piece, which is also written to the file. */
static char *write_scene(const char *piece, size_t count) {
    char *text = malloc(count * (strlen(piece) + 1) + 3), *end = text;
    for (size_t i = 0; i < count; ++i) {
        end = stpcpy(stpcpy(end, i == 0 ? "[" : ","), piece);
    }
    strcpy(end, "]");
    write_string(at("memory.json"), text);
    return text;
}

static size_t taken(void) {
    const struct mallinfo2 all = mallinfo2();
    return all.uordblks + all.hblkhd;
}

static bool passes(size_t limit) {
    vsh_run run = run_within(limit);
    OWNED(vsh_scene) *scene = NULL;
    const vsh_result result = vsh_scene_read(at("memory.json"), &run, &scene, &failure);
    assert_true(result != VSH_ERROR_LIMIT || strstr(failure.message, "memory.json") != NULL);
    OWNED(vsh_flat_scene) *flat = NULL;
    assert_true((vsh_flat_scene_read(at("memory.json"), &run, &flat, NULL) == VSH_ERROR_LIMIT) ==
                (result == VSH_ERROR_LIMIT));
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

TEST(reading_takes_less_than_the_least_limit_that_it_passes) {
    if (VSHI_SANITIZED) {
        skip(); /* their allocator takes more, and does not report it */
    }
    static const char *const pieces[] = {
        "{}",
        "[]",
        "1",
        "\"\"",
        "\"{[,:\\\"\"",
        "{\"a\":0}",
        "{\"a\":[]}",
        "[1,2,3]",
        "[1,2,3,4,5,6,7,8,9]",
        "{\"a\":1,\"b\":2,\"c\":3,\"d\":4,\"e\":5,\"f\":6,\"g\":7,\"h\":8,\"i\":9}"};
    for (size_t i = 0; i < COUNT_OF(pieces); ++i) {
        for (size_t count = 900; count <= 9000; count *= 3) {
            FREED char *text = write_scene(pieces[i], count);
            const size_t before = taken();
            json_t *root = json_loads(text, 0, NULL);
            assert_non_null(root);
            const size_t takes = taken() - before + strlen(text);
            json_decref(root);
            const size_t limit = least_limit();
            assert_that(takes <= limit && limit <= 8 * takes, "%zu times %s: takes %zu, passes at %zu", count,
                        pieces[i], takes, limit);
        }
    }
}

TEST(a_file_that_parses_into_too_much_memory_is_refused_unread) {
    free(write_scene("{}", 300000));
    const size_t before = taken();
    assert_false(passes((size_t)50 << 20));
    assert_true(taken() <= before + 65536);
}

FIXTURE(make_folder, remove_folder)
