/* Scenes from text, for their tests. */
#ifndef TESTS_SCENES_H
#define TESTS_SCENES_H

#include "scene/scene.h"
#include "testing.h"

static inline vsh_scene *parse(const char *path, const char *text) {
    vsh_scene *scene = NULL;
    assert_ok(vshi_scene_parse(path, text, strlen(text), NULL, &scene, &failure));
    assert_non_null(scene);
    return scene;
}

static inline char *read_text(const char *path, size_t *size) {
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    char *text = calloc(1, 1 << 16);
    assert_non_null(text);
    *size = fread(text, 1, (1 << 16) - 1, file);
    fclose(file);
    assert_true(*size > 0);
    return text;
}

static const char seeds_path[] = VSH_ASSETS "/seeds.json";

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

#endif
