/* vsh_scene_read(): a scene file, from its text. */
#include "scene/scene.h"

#include "base/error.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/try.h"
#include "model/unsupported.h"
#include "json/json.h"

#include <stdlib.h>

vsh_result vshi_scene_text(const char *path, const vsh_run *run, char **text, size_t *size,
                           vsh_error *error) {
    *text = NULL;
    *size = 0;
    VSHI_TRY(vshi_unsupported_check(path, error));
    return vshi_json_text(path, run, text, size, error);
}

vsh_result vsh_scene_read(const char *path, const vsh_run *run, vsh_scene **scene, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(scene);
    *scene = NULL;
    VSHI_NEEDS(path);
    char *text = NULL;
    size_t size;
    vsh_run full;
    vsh_result result = VSH_OK;
    VSHI_TRY_DONE(vshi_run_resolve(run, &full, error));
    VSHI_TRY_DONE(vshi_scene_text(path, &full, &text, &size, error));
    VSHI_TRY_DONE(vshi_scene_parse(path, text, size, &full, scene, error));
done:
    free(text);
    return result;
}
