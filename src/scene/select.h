/* Which of a file's meshes a caster or receiver takes. */
#ifndef VSHI_SELECT_H
#define VSHI_SELECT_H

#include <vdbshade/scene.h>

#include <stdbool.h>

/* *chosen [mesh count]: 1 for each mesh that the selection means; to be freed, also after an error. `path` is
 * the model's, for messages. Errors: VSH_ERROR_INPUT where a pattern matches nothing (with names that it
 * might have meant) or nothing is left; VSH_ERROR_ARGUMENT where a pattern is NULL; VSH_ERROR_MEMORY. */
vsh_result vshi_select(const vsh_model *model, const char *path, const vsh_selection *selection,
                       unsigned char **chosen, vsh_error *error);

/* The same of a list of patterns: *chosen is 1 for each mesh that one of them matches, of none of them for
 * no mesh. */
vsh_result vshi_select_some(const vsh_model *model, const char *path, const char *const *patterns,
                            size_t count, unsigned char **chosen, vsh_error *error);

/* The name of a mesh's object; "" where it has none. */
static inline const char *vshi_object_name(const vsh_mesh *mesh) {
    const char *name = mesh->object_name != NULL ? mesh->object_name : mesh->name;
    return name != NULL ? name : "";
}

/* Whether a pattern means a mesh by its object's name, as vsh_mesh_matches() does, or by its `material`'s:
 * that is asked where it means no mesh by the other. */
bool vshi_mesh_is_meant(const vsh_mesh *mesh, const char *pattern, bool material);

/* VSH_ERROR_INPUT, saying what a pattern may have meant that matches none of a model's meshes. */
vsh_result vshi_fail_unmatched(const vsh_model *model, const char *path, const char *pattern,
                               vsh_error *error);

/* Takes those out of `chosen` that cannot receive, where the receiver is partial and not unwrapped; else
 * errors: VSH_ERROR_INPUT where a mesh has no UVs or not the set, VSH_ERROR_ARGUMENT where there is no such
 * set. */
vsh_result vshi_select_uvs(const vsh_model *model, const vsh_receiver *receiver, const vsh_run *run,
                           unsigned char *chosen, vsh_error *error);

#endif
