#include "planes.h"

#include "message.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Channels of the error that is left: only where the method knows it. */
static bool has_light_errors(const vsh_scene *scene) {
    return scene->error && (vsh_shadow_method_traits(scene->shade.method) & VSH_METHOD_RAYS) != 0;
}

static bool has_ao_error(const vsh_scene *scene) {
    return scene->error && scene->ao && (vsh_ao_method_traits(scene->shade.ao_method) & VSH_METHOD_RAYS) != 0;
}

static bool has_tints(const vsh_scene *scene) {
    return scene->tint.type != VSH_TINT_NONE;
}

int32_t cli_planes_interleaved(const vsh_scene *scene) {
    return 3 * ((scene->irradiance ? 1 : 0) + (scene->bent ? 1 : 0) +
                (has_tints(scene) ? (int32_t)scene->light_count : 0));
}

/* The next three channels, "WHAT.R" and so on. */
static void name_triple(cli_planes *planes, size_t *at, const char *what, const char *axes) {
    planes->triples[planes->triple_count++].first = *at;
    for (int c = 0; c < 3; ++c) {
        snprintf(planes->names[(*at)++], VSH_CHANNEL_NAME, "%s.%c", what, axes[c]);
    }
}

static void name_channels(cli_planes *planes, const vsh_scene *scene) {
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
    if (scene->irradiance) {
        name_triple(planes, &at, "irradiance", "RGB");
    }
    if (scene->bent) {
        name_triple(planes, &at, "bent", "XYZ");
    }
    for (size_t i = 0; i < scene->light_count && has_tints(scene); ++i) {
        char name[VSH_CHANNEL_NAME - 2];
        snprintf(name, sizeof name, "tint.%s", scene->lights[i].name);
        name_triple(planes, &at, name, "RGB");
    }
    if (scene->invalid) {
        snprintf(planes->names[at++], VSH_CHANNEL_NAME, "invalid");
    }
    snprintf(planes->names[at++], VSH_CHANNEL_NAME, "A");
}

int cli_planes_name(cli_planes *planes, const vsh_scene *scene, int32_t width, int32_t height) {
    memset(planes, 0, sizeof *planes);
    const size_t interleaved = (size_t)cli_planes_interleaved(scene);
    const size_t count = scene->light_count * (has_light_errors(scene) ? 2 : 1) + (scene->ao ? 1 : 0) +
                         (has_ao_error(scene) ? 1 : 0) + interleaved + (scene->invalid ? 1 : 0) + 1;
    if (count > VSH_MAX_CHANNELS) {
        return cli_usage("scene: %zu channels, at most %d", count, VSH_MAX_CHANNELS);
    }
    planes->names = calloc(count, sizeof *planes->names);
    planes->name_list = calloc(count, sizeof *planes->name_list);
    planes->planes = calloc(count, sizeof *planes->planes);
    planes->triples = calloc(interleaved / 3 + 1, sizeof *planes->triples);
    planes->tints = calloc(scene->light_count + 1, sizeof *planes->tints);
    if (planes->names == NULL || planes->name_list == NULL || planes->planes == NULL ||
        planes->triples == NULL || planes->tints == NULL) {
        return cli_out_of_memory("channels");
    }
    name_channels(planes, scene);
    for (size_t i = 0; i < count; ++i) {
        planes->name_list[i] = planes->names[i];
    }
    planes->image =
        (vsh_image){width, height, (int32_t)count, planes->name_list, (const float *const *)planes->planes};
    return CLI_OK;
}

/* The planes as the bake takes them. */
static void fill_lightmap(cli_planes *planes, const vsh_scene *scene) {
    vsh_lightmap *lightmap = &planes->lightmap;
    float *const *next = planes->planes;
    lightmap->shadow = scene->light_count > 0 ? next : NULL;
    next += scene->light_count;
    if (scene->ao) {
        lightmap->ao = *next++;
    }
    if (has_light_errors(scene) && scene->light_count > 0) {
        lightmap->shadow_error = next;
        next += scene->light_count;
    }
    if (has_ao_error(scene)) {
        lightmap->ao_error = *next;
    }
    lightmap->coverage = planes->planes[planes->image.channel_count - 1];
    lightmap->invalid = planes->invalid;
    const cli_triple *triple = planes->triples;
    if (scene->irradiance) {
        lightmap->irradiance = (triple++)->values;
        lightmap->ambient = scene->has_ambient ? scene->ambient : NULL;
    }
    if (scene->bent) {
        lightmap->bent = (triple++)->values;
        lightmap->bent_space = scene->bent - 1;
    }
    lightmap->tint_by = scene->tint;
    if (has_tints(scene)) {
        for (size_t i = 0; i < scene->light_count; ++i) {
            planes->tints[i] = (triple++)->values;
        }
        lightmap->tint = planes->tints;
    }
}

int cli_planes_allocate(cli_planes *planes, const vsh_scene *scene, int32_t rows, bool invalid,
                        uint64_t limit, const char *output) {
    const size_t count = (size_t)planes->image.channel_count;
    const size_t texels = (size_t)planes->image.width * (size_t)rows; /* at most 2^32 */
    const double bytes = (double)texels * sizeof(float) *
                         ((double)count + 3.0 * (double)planes->triple_count + (invalid ? 1.0 : 0.0));
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
            return cli_out_of_memory(output);
        }
    }
    for (size_t t = 0; t < planes->triple_count; ++t) {
        planes->triples[t].values = calloc(texels, 3 * sizeof(float));
        if (planes->triples[t].values == NULL) {
            return cli_out_of_memory(output);
        }
    }
    if (invalid && (planes->invalid = calloc(texels, sizeof(float))) == NULL) {
        return cli_out_of_memory(output);
    }
    fill_lightmap(planes, scene);
    return CLI_OK;
}

void cli_planes_split(cli_planes *planes) {
    const size_t texels = (size_t)planes->image.width * (size_t)planes->rows;
    for (size_t t = 0; t < planes->triple_count; ++t) {
        const cli_triple *triple = &planes->triples[t];
        for (size_t i = 0; i < texels; ++i) {
            for (size_t c = 0; c < 3; ++c) {
                planes->planes[triple->first + c][i] = triple->values[3 * i + c];
            }
        }
    }
    const size_t last = (size_t)planes->image.channel_count - 1;
    const bool channel = last > 0 && strcmp(planes->names[last - 1], "invalid") == 0;
    for (size_t i = 0; channel && planes->invalid != NULL && i < texels; ++i) {
        planes->planes[last - 1][i] = planes->invalid[i] > 0.0f ? 1.0f : 0.0f;
    }
}

void cli_planes_free(cli_planes *planes) {
    for (size_t t = 0; t < planes->triple_count; ++t) {
        free(planes->triples[t].values);
    }
    for (int32_t i = 0; planes->planes != NULL && i < planes->image.channel_count; ++i) {
        free(planes->planes[i]);
    }
    free(planes->invalid);
    free(planes->tints);
    free(planes->triples);
    free(planes->planes);
    free(planes->name_list);
    free(planes->names);
    memset(planes, 0, sizeof *planes);
}
