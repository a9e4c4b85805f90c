/* The scene reader on a text in memory. */
#ifndef VSHI_SCENE_H
#define VSHI_SCENE_H

#include <vdbshade/scene.h>

/* As vsh_scene_read(), of a text that was read from `path`. With a run of NULL no file is opened: those of
 * lights have none then. */
vsh_result vshi_scene_parse(const char *path, const char *text, size_t size, const vsh_run *run,
                            vsh_scene **scene, vsh_error *error);

/* The text of a scene file, as vshi_json_text(); files of other programs' scenes are told by name. */
vsh_result vshi_scene_text(const char *path, const vsh_run *run, char **text, size_t *size, vsh_error *error);

#endif
