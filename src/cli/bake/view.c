/* --view: the page of what was baked. */
#include "bake.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/temporary.h"

int cli_bake_check_view(const cli_bake_settings *settings, const vsh_scene *scene) {
    const char *page = settings->view;
    if (page == NULL) {
        return CLI_OK;
    }
    if (!cli_has_ending(page, "html")) {
        return cli_usage("--view '%s': expected a name that ends in .html", page);
    }
    const bool images = settings->per_object && !vsh_lit_is_output(scene->receivers[0].output);
    if (images || scene->receiver_count != 1 || scene->receivers[0].type != VSH_RECEIVER_MESH) {
        return cli_usage("--view '%s': shows one lightmap of one mesh; 'vdbshade view' shows others", page);
    }
    const int32_t unwrap = scene->receivers[0].unwrap;
    if (!vsh_lit_is_output(scene->receivers[0].output) &&
        (unwrap == VSH_RECEIVER_UNWRAP_AUTO || unwrap == VSH_RECEIVER_UNWRAP_ALWAYS)) {
        return cli_usage("--view '%s': an image does not hold the UVs that are made; bake a .glb", page);
    }
    if (cli_has_ending(scene->receivers[0].output, "obj")) {
        return cli_usage("--view '%s': shows what a .glb, a .gltf or an image holds, not an .obj", page);
    }
    if (cli_same_file(page, scene->receivers[0].output) || cli_same_file(page, settings->input)) {
        return cli_usage("--view '%s': is also the input or the output", page);
    }
    return cli_temporary_check(page);
}

int cli_bake_view(const cli_bake_settings *settings, const vsh_scene *scene, const vsh_run *run) {
    const vsh_receiver *receiver = &scene->receivers[0];
    if (settings->view == NULL) {
        return CLI_OK;
    }
    vsh_view_bake bake = vsh_view_bake_default();
    if (cli_has_ending(receiver->output, "glb") || cli_has_ending(receiver->output, "gltf")) {
        bake.model = receiver->output; /* its light is in it */
    } else {
        bake.model = receiver->path;
        bake.planes = (const char *const *)&receiver->output;
        bake.plane_count = 1;
        bake.uv_set = receiver->uv_set;
    }
    vsh_error error;
    const vsh_result result = vsh_view_write(settings->view, &bake, NULL, run, &error);
    return result == VSH_OK ? CLI_OK : cli_fail_of(NULL, &error);
}
