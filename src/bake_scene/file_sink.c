#include "bake_scene/file_sink.h"

#include "bake_scene/warn.h"
#include "base/try.h"

/* Tells whoever may end the process what stands there half written. */
static void tell_writing(const vsh_bake_job *job, const char *path) {
    if (job->options.writing != NULL) {
        job->options.writing(job->options.user, path);
    }
}

static vsh_result begin(void *user, const vsh_job_lightmap *lightmap, const vsh_image *image,
                        vsh_error *error) {
    vshi_file_sink *files = user;
    const vsh_bake_job *job = files->job;
    vsh_image_options options = vshi_receiver_image(&job->scene.receivers[lightmap->receiver]);
    options.attributes = vsh_provenance_attributes(job->provenance, &options.attribute_count);
    files->output = lightmap->output;
    tell_writing(job, files->output);
    const vsh_result result = vsh_image_writer_create(files->output, image, &options, &files->writer, error);
    if (result != VSH_OK) {
        tell_writing(job, NULL);
    }
    return result;
}

static vsh_result add(void *user, int32_t rows, const float *const *planes, vsh_error *error) {
    vshi_file_sink *files = user;
    return vsh_image_writer_add(files->writer, rows, planes, error);
}

static vsh_result finish(vshi_file_sink *files, vsh_error *error) {
    vsh_image_clipping cut;
    const vsh_result result = vsh_image_writer_get_clipping(files->writer, &cut, error);
    if (result != VSH_OK) {
        vsh_image_writer_abandon(files->writer);
        return result;
    }
    VSHI_TRY(vsh_image_writer_finish(files->writer, error));
    vshi_warn_clipping(files->output, &cut, files->run);
    return VSH_OK;
}

static vsh_result end(void *user, vsh_result result, vsh_error *error) {
    vshi_file_sink *files = user;
    if (result == VSH_OK) {
        result = finish(files, error);
    } else {
        vsh_image_writer_abandon(files->writer);
    }
    files->writer = NULL;
    tell_writing(files->job, NULL);
    return result;
}

vsh_row_sink vshi_file_sink_of(vshi_file_sink *files) {
    return (vsh_row_sink){sizeof(vsh_row_sink), begin, add, end, files};
}
