/* What an output was made of, as lines of text: settings as they are in force, and hashes of all inputs. */
#include "base/attributes.h"
#include "base/decimal.h"
#include "base/digest.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"
#include "light/light.h"
#include "scene/inputs.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/provenance.h>

enum { NAME_SIZE = 96, LINE_SIZE = 512, HASH_PREFIX = sizeof "sha256:" - 1 };
enum { HASH_UNITS = 1 << 30 }; /* of the job, for all inputs */
enum { RAYS = 64 };            /* of methods that keep no error, where none are given */

struct vsh_provenance {
    vshi_attributes attributes;
};

static vsh_result out_of_memory(vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_MEMORY, "provenance: the system refused memory");
}

static vsh_result add(vsh_provenance *p, const char *name, const char *value, vsh_error *error) {
    return vshi_attributes_add(&p->attributes, name, value) ? VSH_OK : out_of_memory(error);
}

static const char MAX_ERROR[] = ", max error ", RAYS_GIVEN[] = " rays";

/* Of methods that cast rays: how many, which, and to what error. */
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

static vsh_result add_shadow(vsh_provenance *p, const vsh_provenance_source *source, vsh_error *error) {
    char text[LINE_SIZE], more[LINE_SIZE / 2] = "";
    const vsh_shade_options *o = &source->scene->shade;
    const int32_t method = vsh_shadow_method_resolve(o->method, source->has_triangles);
    const uint32_t traits = vsh_shadow_method_traits(method);
    if ((traits & VSH_METHOD_RAYS) != 0) {
        describe_rays(o, (traits & VSH_METHOD_KEEPS_ERROR) != 0, more, sizeof more);
    } else if (o->jitter > 0.0) {
        snprintf(more, sizeof more, ", jitter %.9g", o->jitter);
    }
    snprintf(text, sizeof text, "%s%s", vsh_get_name(VSH_NAMES_SHADOW, method), more);
    return add(p, "vdbshade_shadow", text, error);
}

/* AO's method: of AO itself `what` is "within 2", of the sky "over y". */
static vsh_result add_open(vsh_provenance *p, const vsh_provenance_source *source, const char *name,
                           const char *what, vsh_error *error) {
    char text[LINE_SIZE], more[LINE_SIZE / 2] = "";
    const vsh_shade_options *o = &source->scene->shade;
    const int32_t method = vsh_ao_method_resolve(o->ao_method, source->has_triangles);
    const uint32_t traits = vsh_ao_method_traits(method);
    if ((traits & VSH_METHOD_RAYS) != 0) {
        describe_rays(o, (traits & VSH_METHOD_KEEPS_ERROR) != 0, more, sizeof more);
    } else if (method == VSH_AO_CONES) {
        snprintf(more, sizeof more, ", %d cones", o->ao_cones);
    }
    snprintf(text, sizeof text, "%s %s%s", vsh_get_name(VSH_NAMES_AO, method), what, more);
    return add(p, name, text, error);
}

static vsh_result add_scene(vsh_provenance *p, const vsh_provenance_source *source, vsh_error *error) {
    const vsh_scene *scene = source->scene;
    if (scene->light_count > 0) {
        VSHI_TRY(add_shadow(p, source, error));
    }
    char what[NAME_SIZE];
    if (scene->ao) {
        snprintf(what, sizeof what, "within %.9g", scene->shade.ao_distance);
        VSHI_TRY(add_open(p, source, "vdbshade_ao", what, error));
    }
    if (source->lightmap != 0 && scene->planes.sky != VSH_UP_NONE) {
        snprintf(what, sizeof what, "over %s", vsh_get_name(VSH_NAMES_UP, scene->planes.sky));
        VSHI_TRY(add_open(p, source, "vdbshade_sky", what, error));
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

static vsh_result add_inputs(vsh_provenance *p, const vshi_inputs *inputs, vshi_job *job, vsh_error *error) {
    for (size_t i = 0; i < inputs->count; ++i) {
        const char *path = inputs->paths[i];
        const char *slash = strrchr(path, '/');
        char name[NAME_SIZE], digest[VSH_DIGEST_TEXT];
        VSHI_TRY(vshi_file_digest(path, digest, job, error));
        const char *last = slash != NULL ? slash + 1 : path;
        const size_t size = HASH_PREFIX + VSH_DIGEST_TEXT + 1 + strlen(last);
        char *text = malloc(size);
        if (text == NULL) {
            return out_of_memory(error);
        }
        snprintf(text, size, "sha256:%s %s", digest, last);
        snprintf(name, sizeof name, "vdbshade_input_%zu", i);
        const vsh_result result = add(p, name, text, error);
        free(text);
        if (result != VSH_OK) {
            return result;
        }
        if (vshi_job_advance(job, HASH_UNITS / inputs->count)) {
            return vshi_job_fail_cancelled(job, error);
        }
    }
    return VSH_OK;
}

static vsh_result fill(vsh_provenance *p, const vsh_provenance_source *source, const vsh_run *run,
                       vsh_error *error) {
    VSHI_NUMBERS;
    VSHI_TRY(add_settings(p, source, error));
    vshi_inputs inputs = {NULL, 0, 0};
    vshi_job *job = vshi_job_begin(run, "hash", HASH_UNITS);
    if (job == NULL) {
        return out_of_memory(error);
    }
    vsh_result result =
        vshi_inputs_find(source->scene, source->files, source->file_count, run, job, &inputs, error);
    result = result == VSH_OK ? add_inputs(p, &inputs, job, error) : result;
    vshi_job_end(job);
    vshi_inputs_free(&inputs);
    return result;
}

vsh_result vsh_provenance_create(const vsh_provenance_source *source, const vsh_run *run,
                                 vsh_provenance **provenance, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(provenance);
    *provenance = NULL;
    VSHI_NEEDS(source);
    vsh_provenance_source full = vsh_provenance_source_default();
    vsh_run settings;
    VSHI_TRY(vshi_options_resolve(source, &full, sizeof full, "provenance source", error));
    VSHI_TRY(vshi_run_resolve(run, &settings, error));
    vsh_provenance *made = NULL;
    VSHI_TRY(vshi_allocate((void **)&made, 1, sizeof *made, "provenance", error));
    const vsh_result result = fill(made, &full, &settings, error);
    if (result != VSH_OK) {
        vsh_provenance_free(made);
        return result;
    }
    *provenance = made;
    return VSH_OK;
}

const vsh_attribute *vsh_provenance_attributes(const vsh_provenance *provenance, size_t *count) {
    *count = provenance != NULL ? provenance->attributes.count : 0;
    return provenance != NULL ? provenance->attributes.list : NULL;
}

double vsh_provenance_max_error(const vsh_attribute *attributes, size_t count, const char *channel) {
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
