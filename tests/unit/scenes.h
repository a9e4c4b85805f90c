/* Scenes from text, for their tests. */
#pragma once

#include "scene/scene.h"
#include "testing.h"

static inline vsh_scene *parse(const char *path, const char *text) {
    vsh_scene *scene = NULL;
    assert_ok(vshi_scene_parse(path, text, strlen(text), &scene, &failure));
    assert_non_null(scene);
    return scene;
}

static const char seeds_path[] = VSH_ASSETS "/seeds.json";
