/* Bakes the lightmaps of a scene file (docs/scene.md) into the files that it names: scene SCENE.json */
#include <stdio.h>
#include <vdbshade/vdbshade.h>

static void warn(void *user, const char *message) {
    (void)user;
    fprintf(stderr, "scene: warning: %s\n", message);
}

int main(int argc, char **argv) {
    vsh_run run = vsh_run_default();
    run.reader = VSH_READER; /* meshes and images are parsed in a process of their own */
    run.warning = warn;
    vsh_error error;
    vsh_scene *scene = NULL;
    vsh_bake_report report = {.errors = NULL};
    if (vsh_scene_read(argc > 1 ? argv[1] : "scene.json", NULL, &scene, &error) != VSH_OK ||
        vsh_bake_scene(scene, NULL, &run, &report, &error) != VSH_OK) {
        fprintf(stderr, "scene: %s\n", error.message);
        vsh_scene_free(scene);
        return 1;
    }
    printf("%s: %llu texels\n", scene->receivers[0].output, (unsigned long long)report.texels);
    vsh_scene_free(scene);
    return 0;
}
