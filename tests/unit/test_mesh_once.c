/* A bake looks each mesh over once and welds it once, in however many rooms it is used. The linker sends the
 * calls that do so through here. */
#include "images.h"
#include "testing.h"

#include "mesh/mesh.h"

static int validated, looked_over, welded, edges_counted;

vsh_result __real_vshi_mesh_validate(const vsh_mesh *mesh, size_t index, vsh_error *error);
vsh_result __wrap_vshi_mesh_validate(const vsh_mesh *mesh, size_t index, vsh_error *error);
vsh_result __wrap_vshi_mesh_validate(const vsh_mesh *mesh, size_t index, vsh_error *error) {
    ++validated;
    return __real_vshi_mesh_validate(mesh, index, error);
}

vsh_result __real_vshi_mesh_look_over(const vsh_mesh *mesh, size_t index, vsh_mesh_report *report,
                                      vsh_error *error);
vsh_result __wrap_vshi_mesh_look_over(const vsh_mesh *mesh, size_t index, vsh_mesh_report *report,
                                      vsh_error *error);
vsh_result __wrap_vshi_mesh_look_over(const vsh_mesh *mesh, size_t index, vsh_mesh_report *report,
                                      vsh_error *error) {
    ++looked_over;
    return __real_vshi_mesh_look_over(mesh, index, report, error);
}

vsh_result __real_vshi_mesh_weld(const vsh_mesh *mesh, uint32_t *weld, vsh_error *error);
vsh_result __wrap_vshi_mesh_weld(const vsh_mesh *mesh, uint32_t *weld, vsh_error *error);
vsh_result __wrap_vshi_mesh_weld(const vsh_mesh *mesh, uint32_t *weld, vsh_error *error) {
    ++welded;
    return __real_vshi_mesh_weld(mesh, weld, error);
}

vsh_result __real_vshi_mesh_count_edges(const vsh_mesh *mesh, vsh_mesh_report *report, vsh_error *error);
vsh_result __wrap_vshi_mesh_count_edges(const vsh_mesh *mesh, vsh_mesh_report *report, vsh_error *error);
vsh_result __wrap_vshi_mesh_count_edges(const vsh_mesh *mesh, vsh_mesh_report *report, vsh_error *error) {
    ++edges_counted;
    return __real_vshi_mesh_count_edges(mesh, report, error);
}

static const char box[] = "o box\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
                          "vt 0 0\nvt 0.45 0\nvt 0.45 0.45\nvt 0 0.45\n"
                          "f 1/1 4/2 3/3 2/4\nf 5 6 7\nf 5 7 8\nf 1 2 6 5\nf 4 8 7 3\nf 1 5 8 4\nf 2 3 7 6\n";
static const char floor_of_two[] = "v -4 -1 -4\nv 4 -1 -4\nv 4 -1 4\nv -4 -1 4\n"
                                   "v -4 -2 -4\nv 4 -2 -4\nv 4 -2 4\nv -4 -2 4\n"
                                   "vt 0 0\nvt 0.45 0\nvt 0.45 0.45\nvt 0 0.45\n"
                                   "vt 0.5 0.5\nvt 0.95 0.5\nvt 0.95 0.95\nvt 0.5 0.95\n"
                                   "o upper\nf 1/1 4/4 3/3 2/2\no lower\nf 5/5 8/8 7/7 6/6\n";

/* Boxes cast in two layers and one of them is baked, too; the floor only receives. */
static const char text[] =
    "{\"casters\":[{\"mesh\":\"box.obj\"},"
    "{\"mesh\":\"box.obj\",\"transform\":{\"translate\":[2,0,0]},\"layer\":\"far\"},"
    "{\"mesh\":\"box.obj\",\"transform\":{\"translate\":[0,0,2]}}],"
    "\"layers\":[{\"name\":\"far\"}],\"resolution\":16,\"ao\":{\"distance\":0.5},\"method\":\"%s\","
    "\"lights\":[{\"name\":\"sun\",\"type\":\"directional\",\"direction\":[0,1,0.2],\"angle_deg\":5}],"
    "\"receivers\":[{\"mesh\":\"box.obj\",\"size\":16,\"output\":\"box.exr\"},"
    "{\"mesh\":\"floor.obj\",\"size\":16,\"allow_overlap\":true,\"output\":\"floor.exr\"}]}";

enum { CASTERS = 3, FLOORS = 2, MESHES = CASTERS + FLOORS };

static void write_text(const char *name, const char *what) {
    FILE *file = fopen(at(name), "wb");
    assert_non_null(file);
    assert_true(fputs(what, file) >= 0);
    assert_int_equal(fclose(file), 0);
}

static void bake(const char *method) {
    char scene_text[2048];
    snprintf(scene_text, sizeof scene_text, text, method);
    write_text("box.obj", box);
    write_text("floor.obj", floor_of_two);
    write_text("scene.json", scene_text);
    OWNED(vsh_scene) *scene = NULL;
    assert_ok(vsh_scene_read(at("scene.json"), NULL, &scene, &failure));
    validated = looked_over = welded = edges_counted = 0;
    assert_ok(vsh_bake_scene(scene, NULL, NULL, NULL, &failure));
    assert_int_equal(looked_over, MESHES);
    assert_int_equal(welded, MESHES);
    assert_int_equal(edges_counted, 0); /* what nobody reads */
    assert_int_equal(validated, MESHES);
}

TEST(a_bake_that_marches_or_traces_checks_and_welds_each_mesh_once) {
    bake("adaptive");
    bake("exact");
}

/* The calls that take arrays of meshes, too. */
TEST(occluders_of_arrays_are_checked_and_welded_once) {
    static const float positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    static const uint32_t indices[] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    const vsh_mesh mesh = {
        .positions = positions, .vertex_count = 4, .indices = indices, .triangle_count = 4};
    vsh_occluders_options options = vsh_occluders_options_default();
    options.grid.resolution = 16;
    validated = looked_over = welded = 0;
    OWNED(vsh_occluders) *occluders = NULL;
    assert_ok(vsh_occluders_create(&mesh, 1, &options, NULL, &occluders, &failure));
    assert_int_equal(validated, 1);
    assert_int_equal(looked_over, 1);
    assert_int_equal(welded, 1);
}

FIXTURE(make_folder, remove_folder)
