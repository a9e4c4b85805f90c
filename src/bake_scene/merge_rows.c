/* Rows out of parts: read with those around them, filled, and handed on. */
#include "bake/part.h"
#include "bake_scene/lightmap.h"
#include "bake_scene/warn.h"
#include "base/memory.h"
#include "base/try.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static vsh_result hold(vshi_channels *channels, bool own, vshi_held_rows *held, vsh_error *error) {
    const size_t texels = (size_t)held->width * (size_t)(held->end - held->first);
    const size_t count = (size_t)channels->image.channel_count;
    VSHI_TRY(vshi_allocate((void **)&held->known, texels, sizeof *held->known, "merge", error));
    VSHI_TRY(vshi_allocate((void **)&held->planes, count, sizeof *held->planes, "merge", error));
    if (own) {
        memcpy(held->planes, channels->planes, count * sizeof *held->planes);
        return VSH_OK;
    }
    VSHI_TRY(vshi_allocate((void **)&held->memory, texels, count * sizeof(float), "merge", error));
    for (size_t c = 0; c < count; ++c) {
        held->planes[c] = held->memory + c * texels;
    }
    return VSH_OK;
}

static vsh_result read_rows(const vshi_parts *parts, size_t index, const vshi_held_rows *held,
                            vsh_error *error) {
    for (size_t i = 0; i < parts->place_count; ++i) {
        const vshi_part_place *place = &parts->places[i];
        const int32_t first = place->first > held->first ? place->first : held->first;
        const int32_t end = place->end < held->end ? place->end : held->end;
        if (place->lightmap == index && first < end) {
            VSHI_TRY(vshi_part_read(&parts->list[place->part], place->piece, first, end - first,
                                    (size_t)(first - held->first) * (size_t)held->width, held->planes,
                                    held->known, error));
        }
    }
    return VSH_OK;
}

static vsh_result complete(const vsh_scene *scene, const vsh_charts *charts, const vshi_channels *channels,
                           bool whole, const vshi_held_rows *held, const vsh_run *run, vsh_error *error) {
    vshi_plane padded[VSH_MAX_CHANNELS];
    bool fills;
    vshi_rows_given given = {.width = held->width,
                             .rows = held->end - held->first,
                             .padding = vshi_part_padding(charts, &fills),
                             .known = held->known,
                             .coverage = held->planes[channels->image.channel_count - 1],
                             .planes = padded};
    given.fills = fills && whole;
    given.plane_count = vshi_channels_padded(scene, held->planes, padded);
    return vshi_rows_complete(&given, run, error);
}

/* Copies rows to the channels and notes what lights reach in them. */
static void hand_over(const vshi_held_rows *held, int32_t first, int32_t rows, vshi_lightmap_work *w) {
    vshi_channels *channels = &w->channels;
    const size_t texels = (size_t)held->width * (size_t)rows;
    const size_t at = (size_t)(first - held->first) * (size_t)held->width;
    const float *coverage = held->planes[channels->image.channel_count - 1] + at;
    for (int32_t c = 0; held->memory != NULL && c < channels->image.channel_count; ++c) {
        memcpy(channels->planes[c], held->planes[c] + at, texels * sizeof(float));
    }
    for (size_t i = 0; i < texels; ++i) {
        const uint32_t mesh = held->known[at + i] & VSHI_PART_MESH;
        if (channels->invalid != NULL) {
            channels->invalid[i] = mesh != 0 && coverage[i] != 1.0f ? 1.0f : 0.0f;
        }
        vshi_note_lit(w, i, (size_t)mesh - 1); /* SIZE_MAX: no mesh */
    }
}

vsh_result vshi_parts_take(vshi_lightmap_work *w, int32_t first, int32_t rows, const vsh_run *run,
                           vsh_error *error) {
    const vshi_parts *parts = w->job->parts;
    const vsh_scene *scene = &w->job->scene;
    const vsh_charts *charts = w->input.charts;
    vshi_channels *channels = &w->channels;
    const int32_t height = channels->image.height, reach = vshi_part_reach(charts);
    const bool whole = rows == height;
    vshi_held_rows held = {.width = channels->image.width,
                           .first = first > reach ? first - reach : 0,
                           .end = height - first - rows > reach ? first + rows + reach : height};
    vsh_result result;
    VSHI_TRY_DONE(hold(channels, whole, &held, error));
    VSHI_TRY_DONE(read_rows(parts, w->index, &held, error));
    VSHI_TRY_DONE(vshi_parts_finish(parts, scene, w->index, channels, &held, first, first + rows, run,
                                    &w->baked, error));
    VSHI_TRY_DONE(complete(scene, charts, channels, whole, &held, run, error));
    hand_over(&held, first, rows, w);
    vshi_channels_join(channels, scene);
done:
    free(held.memory);
    free(held.planes);
    free(held.known);
    return result;
}

void vshi_parts_add_stats(const vshi_parts *parts, size_t index, vsh_bake_stats *stats) {
    for (size_t i = 0; i < parts->place_count; ++i) {
        const vshi_part_place *place = &parts->places[i];
        if (place->lightmap != index) {
            continue;
        }
        const vshi_part *part = &parts->list[place->part];
        const vsh_bake_stats *piece = &part->pieces[place->piece];
        stats->texels += piece->texels;
        stats->invalid_texels += piece->invalid_texels;
        vshi_add_shade(&stats->shade, &piece->shade);
        for (uint64_t m = 0; m < part->head.lightmaps[index].mesh_count; ++m) {
            stats->invalid_by_mesh[m] += piece->invalid_by_mesh[m];
        }
        for (uint64_t k = 0; k < part->head.error_count; ++k) {
            vshi_add_bake_error(&stats->errors[k], &piece->errors[k]);
        }
    }
}
