#include "planes.h"

#include "message.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int out_of_memory(const char *what) {
    cli_say("%s: the system refused memory", what);
    return CLI_LIMIT;
}

/* Channels of the error that is left: only where the method knows it. */
static bool has_light_errors(const vsh_scene *scene) {
    return scene->error && scene->shade.method >= VSH_SHADOW_RAYS;
}

static bool has_ao_error(const vsh_scene *scene) {
    return scene->error && scene->ao && scene->shade.ao_method >= VSH_AO_RAYS;
}

int cli_planes_name(cli_planes *planes, const vsh_scene *scene, int32_t width, int32_t height) {
    memset(planes, 0, sizeof *planes);
    const size_t count = scene->light_count * (has_light_errors(scene) ? 2 : 1) + (scene->ao ? 1 : 0) +
                         (has_ao_error(scene) ? 1 : 0) + (scene->irradiance ? 3 : 0) + 1;
    if (count > VSH_MAX_CHANNELS) {
        return cli_usage("scene: %zu channels, at most %d", count, VSH_MAX_CHANNELS);
    }
    planes->names = calloc(count, sizeof *planes->names);
    planes->name_list = calloc(count, sizeof *planes->name_list);
    planes->planes = calloc(count, sizeof *planes->planes);
    if (planes->names == NULL || planes->name_list == NULL || planes->planes == NULL) {
        return out_of_memory("channels");
    }
    size_t at = 0;
    for (size_t i = 0; i < scene->light_count; ++i) {
        snprintf(planes->names[at++], VSH_CHANNEL_NAME, "shadow.%s", scene->lights[i].name);
    }
    if (scene->ao) {
        snprintf(planes->names[at++], VSH_CHANNEL_NAME, "ao");
    }
    for (size_t i = 0; i < scene->light_count && has_light_errors(scene); ++i) {
        snprintf(planes->names[at++], VSH_CHANNEL_NAME, "error.%s", scene->lights[i].name);
    }
    if (has_ao_error(scene)) {
        snprintf(planes->names[at++], VSH_CHANNEL_NAME, "error.ao");
    }
    for (int i = 0; i < 3 && scene->irradiance; ++i) {
        snprintf(planes->names[at++], VSH_CHANNEL_NAME, "irradiance.%c", "RGB"[i]);
    }
    snprintf(planes->names[at++], VSH_CHANNEL_NAME, "A");
    for (size_t i = 0; i < count; ++i) {
        planes->name_list[i] = planes->names[i];
    }
    planes->image =
        (vsh_image){width, height, (int32_t)count, planes->name_list, (const float *const *)planes->planes};
    return CLI_OK;
}

int cli_planes_allocate(cli_planes *planes, const vsh_scene *scene, int32_t rows, uint64_t limit,
                        const char *output) {
    const size_t count = (size_t)planes->image.channel_count;
    const size_t texels = (size_t)planes->image.width * (size_t)rows; /* at most 2^32 */
    const double bytes = (double)texels * sizeof(float) * ((double)count + (scene->irradiance ? 3.0 : 0.0));
    if (bytes > (double)SIZE_MAX / 2.0 || (limit > 0 && bytes > (double)limit)) {
        char need[32], have[32];
        cli_say("%s: %d × %d texels in %zu channels need %s; the memory limit is %s", output,
                planes->image.width, rows, count, cli_bytes_text((uint64_t)bytes, need, sizeof need),
                cli_bytes_text(limit, have, sizeof have));
        return CLI_LIMIT;
    }
    planes->rows = rows;
    for (size_t i = 0; i < count; ++i) {
        planes->planes[i] = calloc(texels, sizeof(float));
        if (planes->planes[i] == NULL) {
            return out_of_memory(output);
        }
    }
    planes->lightmap.shadow = scene->light_count > 0 ? planes->planes : NULL;
    if (scene->ao) {
        planes->lightmap.ao = planes->planes[scene->light_count];
    }
    float **errors = planes->planes + scene->light_count + (scene->ao ? 1 : 0);
    if (has_light_errors(scene) && scene->light_count > 0) {
        planes->lightmap.shadow_error = errors;
        errors += scene->light_count;
    }
    if (has_ao_error(scene)) {
        planes->lightmap.ao_error = *errors;
    }
    planes->lightmap.coverage = planes->planes[count - 1];
    if (scene->irradiance) {
        planes->interleaved = calloc(texels, 3 * sizeof(float));
        if (planes->interleaved == NULL) {
            return out_of_memory(output);
        }
        planes->lightmap.irradiance = planes->interleaved;
    }
    return CLI_OK;
}

void cli_planes_split(cli_planes *planes) {
    if (planes->interleaved == NULL) {
        return;
    }
    const size_t texels = (size_t)planes->image.width * (size_t)planes->rows;
    float *const *rgb = planes->planes + planes->image.channel_count - 4;
    for (size_t i = 0; i < texels; ++i) {
        for (size_t c = 0; c < 3; ++c) {
            rgb[c][i] = planes->interleaved[3 * i + c];
        }
    }
}

void cli_planes_free(cli_planes *planes) {
    free(planes->interleaved);
    for (int32_t i = 0; planes->planes != NULL && i < planes->image.channel_count; ++i) {
        free(planes->planes[i]);
    }
    free(planes->planes);
    free(planes->name_list);
    free(planes->names);
    memset(planes, 0, sizeof *planes);
}
