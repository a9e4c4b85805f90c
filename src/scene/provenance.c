/* Provenance of an output as lines of text: the settings that made it, and hashes of all inputs. */
#include "base/decimal.h"
#include "base/file.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/text.h"
#include "io/model/model.h"
#include "scene/scene.h"
#include "shade/shade.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <vdbshade/scene.h>

enum { NAME_SIZE = 96, LINE_SIZE = 512 };
enum { HASH_UNITS = 1 << 30 }; /* of the job, for all inputs */
enum { RAYS = 64 };            /* default of methods that keep no error */

/* --- inputs: the files that a scene is made of */

typedef struct file_list {
    char **paths;
    size_t count, capacity;
} file_list;

/* Adds a path once and owns it; NULL: memory was short. */
static vsh_result add_path(void *user, char *path, vsh_error *error) {
    file_list *inputs = user;
    bool known = false;
    if (path == NULL) {
        return vshi_fail_memory(error, "inputs");
    }
    for (size_t i = 0; i < inputs->count && !known; ++i) {
        known = strcmp(inputs->paths[i], path) == 0;
    }
    const vsh_result result = known
                                  ? VSH_OK
                                  : vshi_make_room((void **)&inputs->paths, inputs->count, &inputs->capacity,
                                                   sizeof *inputs->paths, "inputs", error);
    if (known || result != VSH_OK) {
        free(path);
        return result;
    }
    inputs->paths[inputs->count++] = path;
    return VSH_OK;
}

static vsh_result copy_path(file_list *inputs, const char *path, vsh_error *error) {
    return path != NULL ? add_path(inputs, strdup(path), error) : VSH_OK;
}

/* Lists `files`, the files of casters and receivers, then the files beside models (io/model/model.h),
 * readable or not. `scene` may be NULL. Free the inputs even after an error. */
static vsh_result find_inputs(const vsh_scene *scene, const char *const *files, size_t file_count,
                              const vsh_run *run, vshi_job *job, file_list *inputs, vsh_error *error) {
    for (size_t i = 0; i < file_count; ++i) {
        VSHI_TRY(copy_path(inputs, files[i], error));
    }
    for (size_t i = 0; scene != NULL && i < scene->caster_count; ++i) {
        VSHI_TRY(copy_path(inputs, scene->casters[i].path, error));
    }
    for (size_t i = 0; scene != NULL && i < scene->receiver_count; ++i) {
        const vsh_receiver *receiver = &scene->receivers[i];
        VSHI_TRY(copy_path(inputs, receiver->type != VSH_RECEIVER_PLANE ? receiver->path : NULL, error));
    }
    const size_t named = inputs->count;
    for (size_t i = 0; i < named; ++i) {
        VSHI_TRY(vshi_model_beside(inputs->paths[i], run, job, add_path, inputs, error));
    }
    return VSH_OK;
}

static void free_inputs(file_list *inputs) {
    for (size_t i = 0; i < inputs->count; ++i) {
        free(inputs->paths[i]);
    }
    free(inputs->paths);
}

static vsh_result check_output(const char *output, const struct stat *status, const file_list *inputs,
                               vsh_error *error) {
    for (size_t i = 0; i < inputs->count; ++i) {
        struct stat input;
        if (stat(inputs->paths[i], &input) == 0 && input.st_ino == status->st_ino &&
            input.st_dev == status->st_dev) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: the output is also an input: %s", output,
                             inputs->paths[i]);
        }
    }
    return VSH_OK;
}

vsh_result vsh_scene_check_outputs(const vsh_scene *scene, const char *const *outputs, size_t output_count,
                                   const vsh_run *run, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(scene);
    VSHI_NEEDS_OF(output_count, outputs);
    for (size_t i = 0; i < output_count; ++i) {
        VSHI_NEEDS(outputs[i]);
    }
    vsh_run settings;
    VSHI_TRY(vshi_run_resolve(run, &settings, error));
    file_list inputs = {NULL, 0, 0};
    vshi_job *job = NULL;
    vsh_result result = VSH_OK;
    for (size_t i = 0; i < output_count; ++i) {
        struct stat status;
        if (stat(outputs[i], &status) != 0) {
            continue;
        }
        if (job == NULL) {
            VSHI_TRY_DONE(vshi_job_open(&job, &settings, "hash", 1, "inputs", error));
            VSHI_TRY_DONE(find_inputs(scene, NULL, 0, &settings, job, &inputs, error));
        }
        VSHI_TRY_DONE(check_output(outputs[i], &status, &inputs, error));
    }
done:
    vshi_job_end(job);
    free_inputs(&inputs);
    return result;
}

/* --- lines */

struct vsh_provenance {
    vshi_attributes attributes;
};

static vsh_result add(vsh_provenance *p, const char *name, const char *value, vsh_error *error) {
    return vshi_attributes_add(&p->attributes, name, value) ? VSH_OK : vshi_fail_memory(error, "provenance");
}

static const char MAX_ERROR[] = ", max error ", RAYS_GIVEN[] = " rays";

/* Describes the rays of a method: their error, number and sampler. */
static void describe_rays(const vsh_shade_options *o, bool adaptive, char *text, size_t size) {
    int used = 0;
    if (adaptive) {
        used = snprintf(text, size, "%s%.9g", MAX_ERROR, o->max_error);
    }
    if (!adaptive || o->rays > 0) {
        used +=
            snprintf(text + used, size - (size_t)used, ", %d%s", o->rays > 0 ? o->rays : RAYS, RAYS_GIVEN);
    }
    used += snprintf(text + used, size - (size_t)used, ", %s", vsh_get_name(VSH_NAMES_SAMPLER, o->sampler));
    if (o->frame != 0) {
        used += snprintf(text + used, size - (size_t)used, ", frame %d", o->frame);
    }
    if (!adaptive && o->early_rays > 0) {
        snprintf(text + used, size - (size_t)used, ", early rays %d", o->early_rays);
    }
}

/* Adds a method: that of shadows (`ao` false), of AO itself (" within 2") or of the sky (" over y"). */
static vsh_result add_method(vsh_provenance *p, const vsh_provenance_source *source, const char *name,
                             bool ao, const char *what, vsh_error *error) {
    char text[LINE_SIZE], more[LINE_SIZE / 2] = "";
    const vsh_shade_options *o = &source->scene->shade;
    const int32_t method = ao ? vshi_ao_method_resolve(o->ao_method, source->has_triangles)
                              : vshi_shadow_method_resolve(o->method, source->has_triangles);
    const uint32_t traits = vsh_method_traits(ao ? VSH_NAMES_AO : VSH_NAMES_SHADOW, method);
    if ((traits & VSH_METHOD_RAYS) != 0) {
        describe_rays(o, (traits & VSH_METHOD_KEEPS_ERROR) != 0, more, sizeof more);
    } else if (ao && method == VSH_AO_CONES) {
        snprintf(more, sizeof more, ", %d cones", o->ao_cones);
    } else if (!ao && o->jitter > 0.0) {
        snprintf(more, sizeof more, ", jitter %.9g", o->jitter);
    }
    snprintf(text, sizeof text, "%s%s%s", vsh_get_name(ao ? VSH_NAMES_AO : VSH_NAMES_SHADOW, method), what,
             more);
    return add(p, name, text, error);
}

static vsh_result add_scene(vsh_provenance *p, const vsh_provenance_source *source, vsh_error *error) {
    const vsh_scene *scene = source->scene;
    if (scene->light_count > 0) {
        VSHI_TRY(add_method(p, source, "vdbshade_shadow", false, "", error));
    }
    char what[NAME_SIZE];
    if (scene->ao) {
        snprintf(what, sizeof what, " within %.9g", scene->shade.ao_distance);
        VSHI_TRY(add_method(p, source, "vdbshade_ao", true, what, error));
    }
    if (source->lightmap != 0 && scene->planes.sky != VSH_UP_NONE) {
        snprintf(what, sizeof what, " over %s", vsh_get_name(VSH_NAMES_UP, scene->planes.sky));
        VSHI_TRY(add_method(p, source, "vdbshade_sky", true, what, error));
    }
    for (size_t i = 0; i < scene->light_count; ++i) {
        char name[NAME_SIZE], text[LINE_SIZE];
        snprintf(name, sizeof name, "vdbshade_light_%.64s", scene->lights[i].name);
        vsh_light_text(&scene->lights[i], text, sizeof text);
        VSHI_TRY(add(p, name, text, error));
    }
    return VSH_OK;
}

static vsh_result add_settings(vsh_provenance *p, const vsh_provenance_source *source, vsh_error *error) {
    VSHI_TRY(add(p, "vdbshade_version", vsh_version(), error));
    if (source->command != NULL) {
        VSHI_TRY(add(p, "vdbshade_command", source->command, error));
    }
    if (source->scene != NULL) {
        VSHI_TRY(add_scene(p, source, error));
    }
    if (source->voxel_size > 0.0) {
        char text[LINE_SIZE];
        snprintf(text, sizeof text, "%.9g", source->voxel_size);
        VSHI_TRY(add(p, "vdbshade_voxel_size", text, error));
    }
    for (size_t i = 0; i < source->attribute_count; ++i) {
        VSHI_TRY(add(p, source->attributes[i].name, source->attributes[i].value, error));
    }
    return VSH_OK;
}

static vsh_result add_inputs(vsh_provenance *p, const file_list *inputs, vshi_job *job, vsh_error *error) {
    for (size_t i = 0; i < inputs->count; ++i) {
        const char *path = inputs->paths[i];
        char name[NAME_SIZE], digest[VSH_DIGEST_TEXT],
            text[LINE_SIZE]; /* files' names have up to 255 bytes */
        VSHI_TRY(vshi_file_digest(path, digest, job, error));
        snprintf(text, sizeof text, "sha256:%s %s", digest, vshi_path_name(path));
        snprintf(name, sizeof name, "vdbshade_input_%zu", i);
        VSHI_TRY(add(p, name, text, error));
        VSHI_TRY(vshi_job_step(job, HASH_UNITS / inputs->count, error));
    }
    return VSH_OK;
}

vsh_result vsh_provenance_create(const vsh_provenance_source *source, const vsh_run *run,
                                 vsh_provenance **provenance, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NUMBERS;
    VSHI_MAKES(provenance);
    VSHI_NEEDS(source);
    vsh_provenance_source full = vsh_provenance_source_default();
    vsh_run settings;
    VSHI_TRY(vshi_options_resolve(source, &full, sizeof full, "provenance source", error));
    VSHI_TRY(vshi_run_resolve(run, &settings, error));
    file_list inputs = {NULL, 0, 0};
    vsh_provenance *made = NULL;
    vshi_job *job;
    vsh_result result;
    VSHI_TRY(vshi_job_open(&job, &settings, "hash", HASH_UNITS, "provenance", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&made, 1, sizeof *made, "provenance", error));
    VSHI_TRY_DONE(add_settings(made, &full, error));
    VSHI_TRY_DONE(find_inputs(full.scene, full.files, full.file_count, &settings, job, &inputs, error));
    VSHI_TRY_DONE(add_inputs(made, &inputs, job, error));
    *provenance = made;
    made = NULL;
done:
    vsh_provenance_free(made);
    vshi_job_end(job);
    free_inputs(&inputs);
    return result;
}

const vsh_attribute *vsh_provenance_attributes(const vsh_provenance *provenance, size_t *count) {
    *count = provenance != NULL ? provenance->attributes.count : 0;
    return provenance != NULL ? provenance->attributes.list : NULL;
}

double vshi_provenance_max_error(const vsh_attribute *attributes, size_t count, const char *channel) {
    VSHI_NUMBERS;
    const char *name = strcmp(channel, "ao") == 0            ? "vdbshade_ao"
                       : strcmp(channel, "sky") == 0         ? "vdbshade_sky"
                       : strncmp(channel, "shadow.", 7) == 0 ? "vdbshade_shadow"
                                                             : NULL;
    for (size_t i = 0; name != NULL && i < count; ++i) {
        const char *text = strcmp(attributes[i].name, name) == 0 ? attributes[i].value : "";
        const char *at = strstr(text, MAX_ERROR);
        if (at != NULL && strstr(at, RAYS_GIVEN) == NULL) {
            const double error = strtod(at + strlen(MAX_ERROR), NULL);
            return error > 0.0 && error <= 1.0 ? error : NAN;
        }
    }
    return NAN;
}

void vsh_provenance_free(vsh_provenance *provenance) {
    if (provenance != NULL) {
        vshi_attributes_free(&provenance->attributes);
        free(provenance);
    }
}
