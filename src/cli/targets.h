/* The lightmaps of a bake: one a receiver, or (--per-object) one for each object of every receiver. */
#ifndef CLI_TARGETS_H
#define CLI_TARGETS_H

#include <stdbool.h>
#include <vdbshade/scene.h>

/* What stands in an output's path for the name of its object. */
#define CLI_OBJECT_NAME "%s"

typedef struct cli_targets {
    vsh_scene scene;         /* the one given, but with a receiver for each lightmap */
    const vsh_mesh **meshes; /* [scene.receiver_count]: of each lightmap; belong to the assets */
    size_t *mesh_counts;
    vsh_receiver *receivers;
    char **outputs; /* [scene.receiver_count]; NULL: they are the receivers' own */
} cli_targets;

/* CLI_OK or an exit code, having said why. Free them also after a failure. */
int cli_targets_make(const vsh_scene *scene, const vsh_assets *assets, bool per_object, cli_targets *targets);
void cli_targets_free(cli_targets *targets);

/* OUT as a path with CLI_OBJECT_NAME in it: "out/", a folder that is there and "out" (without an ending)
 * become out/%s.exr, out.png becomes out.%s.png. To be freed; NULL where memory was short. */
char *cli_targets_template(const char *output);

/* The folder that a template's files go to, to be freed; NULL where memory was short. */
char *cli_targets_folder(const char *template);

#endif
