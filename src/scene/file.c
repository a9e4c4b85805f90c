/* vsh_scene_read(): a scene file, from its text. */
#include "scene/scene.h"

#include "base/error.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/threads.h"
#include "base/try.h"
#include "model/model.h"
#include "json/json.h"

#include <stdlib.h>

vsh_result vshi_scene_text(const char *path, const vsh_run *run, char **text, size_t *size,
                           vsh_error *error) {
    *text = NULL;
    *size = 0;
    VSHI_TRY(vshi_unsupported_check(path, error));
    return vshi_json_text(path, run, text, size, error);
}

typedef struct reading {
    const char *path;
    const vsh_run *run;
    vsh_scene **scene;
} reading;

static vsh_result read_file(void *user, vsh_error *error) {
    const reading *r = user;
    char *text = NULL;
    size_t size;
    vsh_result result = vshi_scene_text(r->path, r->run, &text, &size, error);
    if (result == VSH_OK) {
        result = vshi_scene_parse(r->path, text, size, r->run, r->scene, error);
    }
    free(text);
    return result;
}

vsh_result vsh_scene_read(const char *path, const vsh_run *run, vsh_scene **scene, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(scene);
    *scene = NULL;
    VSHI_NEEDS(path);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    reading r = {path, &full, scene};
    return vshi_on_stack(read_file, &r, error);
}
