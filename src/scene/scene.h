/* The scene reader on a text in memory. */
#ifndef VSHI_SCENE_H
#define VSHI_SCENE_H

#include <vdbshade/scene.h>

/* As vsh_scene_read(), of a text that was read from `path`. */
vsh_result vshi_scene_parse(const char *path, const char *text, size_t size, vsh_scene **scene,
                            vsh_error *error);

/* The text of a scene file, to be freed with free() also where it fails, which reading as JSON keeps within
 * run->memory_limit. Errors: as vsh_scene_read_run(). */
vsh_result vshi_scene_text(const char *path, const vsh_run *run, char **text, size_t *size, vsh_error *error);

#endif
