/* Scenes from text, for their tests. */
#pragma once

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
    *size = fread(text, 1, (1 << 16) - 1, file);
    fclose(file);
    assert_true(*size > 0);
    return text;
}

static const char seeds_path[] = VSH_ASSETS "/seeds.json";
