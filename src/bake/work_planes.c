#include "bake/work_planes.h"
#include "bake/planes.h"
#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>
#include <string.h>

/* Planes that a kind has at most. */
static size_t most_of(const vshi_plane_kind *kind, size_t light_count) {
    return kind->per_light ? light_count : 1;
}

/* Lists the planes that there are, those that are padded or those that are not. */
static void list(const vsh_lightmap *given, size_t light_count, bool padded, vshi_work_planes *work) {
    size_t kind_count;
    const vshi_plane_kind *kinds = vshi_plane_kinds(&kind_count);
    for (const vshi_plane_kind *kind = kinds; kind < kinds + kind_count; ++kind) {
        for (size_t i = 0; kind->padded == padded && i < most_of(kind, light_count); ++i) {
            float *plane = vshi_plane_of(given, kind, i);
            work->given[work->count] = (vshi_plane){plane, vshi_plane_components(kind)};
            work->count += plane != NULL;
        }
    }
}

double vshi_work_planes_bytes(const vsh_texels *texels, const vsh_lightmap *given, size_t light_count) {
    size_t kind_count, floats = 0;
    const vshi_plane_kind *kinds = vshi_plane_kinds(&kind_count);
    for (const vshi_plane_kind *kind = kinds; kind < kinds + kind_count; ++kind) {
        for (size_t i = 0; i < most_of(kind, light_count); ++i) {
            floats += vshi_plane_of(given, kind, i) != NULL ? vshi_plane_components(kind) : 0;
        }
    }
    return vshi_texels_hold_more(texels) ? (double)(vshi_texels_held(texels) * floats * sizeof(float)) : 0.0;
}

/* What stands for one of the caller's planes. */
static float *own_of(const vshi_work_planes *work, const float *given) {
    for (size_t p = 0; given != NULL && p < work->count; ++p) {
        if (work->given[p].values == given) {
            return work->planes[p].values;
        }
    }
    return NULL;
}

/* Gives every plane memory of its own. */
static vsh_result take_planes(const vsh_texels *texels, const vsh_lightmap *given, size_t light_count,
                              vshi_work_planes *work, vsh_error *error) {
    const size_t texel_count = vshi_texels_held(texels);
    size_t kind_count, floats = 0;
    const vshi_plane_kind *kinds = vshi_plane_kinds(&kind_count);
    for (size_t p = 0; p < work->count; ++p) {
        floats += work->planes[p].channels;
    }
    VSHI_TRY(vshi_allocate((void **)&work->lights, kind_count * (light_count + 1), sizeof *work->lights,
                           "lightmap band", error)); /* there may be no lights */
    VSHI_TRY(
        vshi_allocate((void **)&work->memory, texel_count, floats * sizeof(float), "lightmap band", error));
    float *memory = work->memory;
    for (size_t p = 0; p < work->count; ++p) {
        work->planes[p].values = memory;
        memory += texel_count * work->planes[p].channels;
    }
    for (size_t k = 0; k < kind_count; ++k) {
        float *own = NULL, **planes = kinds[k].per_light ? work->lights + k * light_count : &own;
        bool any = false;
        for (size_t i = 0; i < most_of(&kinds[k], light_count); ++i) {
            planes[i] = own_of(work, vshi_plane_of(given, &kinds[k], i));
            any = any || planes[i] != NULL;
        }
        if (any) {
            vshi_plane_put(&work->lightmap, &kinds[k], planes);
        }
    }
    return VSH_OK;
}

vsh_result vshi_work_planes_open(const vsh_texels *texels, const vsh_lightmap *given, size_t light_count,
                                 vshi_work_planes *work, vsh_error *error) {
    *work = (vshi_work_planes){.lightmap = *given};
    size_t kind_count, most = 1; /* one more is looked at than is kept */
    const vshi_plane_kind *kinds = vshi_plane_kinds(&kind_count);
    for (size_t k = 0; k < kind_count; ++k) {
        most += most_of(&kinds[k], light_count);
    }
    VSHI_TRY(vshi_allocate((void **)&work->planes, most, sizeof *work->planes, "lightmap", error));
    VSHI_TRY(vshi_allocate((void **)&work->given, most, sizeof *work->given, "lightmap", error));
    list(given, light_count, true, work);
    work->padded = work->count;
    list(given, light_count, false, work);
    memcpy(work->planes, work->given, work->count * sizeof *work->planes);
    if (vshi_texels_hold_more(texels)) {
        return take_planes(texels, given, light_count, work, error);
    }
    for (size_t p = 0; p < work->count; ++p) {
        memset(work->planes[p].values, 0,
               vshi_texels_held(texels) * work->planes[p].channels * sizeof(float));
    }
    return VSH_OK;
}

void vshi_work_planes_copy_back(const vsh_texels *texels, const vshi_work_planes *work) {
    const vshi_band *band = &texels->band;
    const size_t width = (size_t)texels->info.width;
    const size_t skipped = width * (size_t)(band->own_first - band->first);
    for (size_t p = 0; work->memory != NULL && p < work->count; ++p) {
        const size_t channels = work->planes[p].channels;
        memcpy(work->given[p].values, work->planes[p].values + skipped * channels,
               width * (size_t)band->own_rows * channels * sizeof(float));
    }
}

void vshi_work_planes_close(vshi_work_planes *work) {
    free(work->memory);
    free(work->lights);
    free(work->given);
    free(work->planes);
    *work = (vshi_work_planes){0};
}
