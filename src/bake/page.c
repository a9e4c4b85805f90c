#include "bake/page.h"

#include "bake/planes.h"
#include "base/memory.h"
#include "shade/ao.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

bool vshi_ao_is_shared(const vsh_shade_options *shade, int32_t spacing, bool layered_ao) {
    return spacing > 1 && !layered_ao &&
           (vsh_ao_method_traits(shade->ao_method) & VSH_METHOD_KEEPS_ERROR) != 0;
}

static vsh_result take_shots(vshi_page *page, vshi_shots *shots, bool open, vsh_error *error) {
    const size_t texels = vshi_page_texels(page), tiles = vshi_charts_tiles(&page->charts->sorted);
    const char *what = "AO texels";
    vshi_store *store = page->store;
    VSHI_TRY(vshi_store_take(store, (void **)&shots->share, texels, sizeof *shots->share, what, error));
    VSHI_TRY(vshi_store_take(store, (void **)&shots->rays, texels, sizeof *shots->rays, what, error));
    VSHI_TRY(vshi_store_take(store, (void **)&shots->level, texels, 1, what, error));
    VSHI_TRY(vshi_store_take(store, (void **)&shots->open, open ? texels : 0, 3 * sizeof *shots->open, what,
                             error));
    return vshi_store_take(store, (void **)&shots->held, tiles, sizeof *shots->held, what, error);
}

/* Whether the page needs any of VSHI_NEEDS_…. */
static bool needs(const vshi_page *page, uint32_t any) {
    return (page->needs & any) != 0;
}

vsh_result vshi_page_open(const vsh_charts *charts, const vsh_lightmap *lightmap, size_t light_count,
                          const vsh_shade_options *shade, bool shared, vshi_store *store, vshi_page *page,
                          vsh_error *error) {
    *page = (vshi_page){.charts = charts,
                        .lightmap = *lightmap,
                        .light_count = light_count,
                        .shade = *shade,
                        .needs = vshi_planes_need(lightmap, light_count),
                        .store = store,
                        .width = (size_t)charts->info.width,
                        .height = (size_t)charts->info.height,
                        .error_count = light_count + 2};
    const size_t texels = vshi_page_texels(page), tiles = vshi_charts_tiles(&charts->sorted);
    const char *what = "lightmap";
    VSHI_TRY(vshi_store_take(store, (void **)&page->state, texels, 1, what, error));
    VSHI_TRY(vshi_store_take(store, (void **)&page->mesh, texels, sizeof *page->mesh, what, error));
    VSHI_TRY(vshi_store_take(store, (void **)&page->stats, tiles, sizeof *page->stats, what, error));
    VSHI_TRY(vshi_store_take(store, (void **)&page->errors, tiles * page->error_count, sizeof *page->errors,
                             what, error));
    const bool ao = shared && needs(page, VSHI_NEEDS_AO), sky = shared && needs(page, VSHI_NEEDS_OPEN);
    if (ao || sky) {
        VSHI_TRY(vshi_store_take(store, (void **)&page->position, texels, 3 * sizeof *page->position, what,
                                 error));
        VSHI_TRY(
            vshi_store_take(store, (void **)&page->normal, texels, 3 * sizeof *page->normal, what, error));
    }
    if (ao && lightmap->bent != NULL && lightmap->bent_space == VSH_BENT_TANGENT) {
        VSHI_TRY(
            vshi_store_take(store, (void **)&page->tangent, texels, 4 * sizeof *page->tangent, what, error));
    }
    if (ao) {
        VSHI_TRY(take_shots(page, &page->ao, needs(page, VSHI_NEEDS_BENT), error));
    }
    return sky ? take_shots(page, &page->sky, false, error) : VSH_OK;
}

double vshi_lightmap_bytes(const vsh_charts *charts, const vsh_lightmap *planes, size_t light_count,
                           bool shared) {
    const uint32_t need = vshi_planes_need_given(planes);
    size_t kind_count, floats = 0;
    const vshi_plane_kind *kinds = vshi_plane_kinds(&kind_count);
    for (size_t k = 0; k < kind_count; ++k) {
        if (vshi_plane_given(planes, &kinds[k])) {
            floats += vshi_plane_components(&kinds[k]) * (kinds[k].per_light ? light_count : 1);
        }
    }
    const bool ao = shared && (need & VSHI_NEEDS_AO) != 0, sky = shared && (need & VSHI_NEEDS_OPEN) != 0;
    const double shots = sizeof(float) + sizeof(int32_t) + 1.0, place = 6.0 * sizeof(float);
    const double estimate = sizeof(vshi_ao_plane) + sizeof(float);
    double own = 1.0 + sizeof(uint32_t);
    own += (ao || sky ? place + estimate : 0.0) + (ao ? shots : 0.0) + (sky ? shots : 0.0);
    own += ao && planes->bent != NULL ? 10.0 * sizeof(float) : 0.0;
    const double filling =
        2.0 + 1.0 + sizeof(uint32_t) + 17.0 / 3.0; /* padding, invalid texels, mip levels */
    const double texels = (double)charts->info.width * (double)charts->info.height;
    return texels * ((double)floats * sizeof(float) + fmax(own, 1.0 + sizeof(uint32_t) + filling));
}

static void free_shots(vshi_page *page, vshi_shots *shots) {
    for (size_t i = 0; shots->held != NULL && i < vshi_charts_tiles(&page->charts->sorted); ++i) {
        free(shots->held[i].list);
    }
    vshi_store_give(page->store, shots->held);
    vshi_store_give(page->store, shots->open);
    vshi_store_give(page->store, shots->level);
    vshi_store_give(page->store, shots->rays);
    vshi_store_give(page->store, shots->share);
    *shots = (vshi_shots){.share = NULL};
}

void vshi_page_close_shots(vshi_page *page) {
    free_shots(page, &page->sky);
    free_shots(page, &page->ao);
    vshi_store_give(page->store, page->tangent);
    vshi_store_give(page->store, page->normal);
    vshi_store_give(page->store, page->position);
    page->tangent = page->normal = page->position = NULL;
}

void vshi_page_close(vshi_page *page) {
    if (page->store == NULL) {
        return;
    }
    vshi_page_close_shots(page);
    vshi_store_give(page->store, page->errors);
    vshi_store_give(page->store, page->stats);
    vshi_store_give(page->store, page->mesh);
    vshi_store_give(page->store, page->state);
    *page = (vshi_page){.store = NULL};
}

void vshi_page_note(vshi_page *page, const vshi_samples *samples, size_t i) {
    const size_t place = vshi_page_place(page, samples->texel[i]);
    const vshi_vec at = vshi_sub(vshi_sample_foot(samples, i), vshi_vec_of(page->charts->centre));
    page->position[3 * place] = (float)at.x;
    page->position[3 * place + 1] = (float)at.y;
    page->position[3 * place + 2] = (float)at.z;
    memcpy(page->normal + 3 * place, samples->normal + 3 * i, 3 * sizeof *page->normal);
    if (page->tangent != NULL) {
        memcpy(page->tangent + 4 * place, samples->tangent + 4 * i, 4 * sizeof *page->tangent);
    }
}

/* Sets what vshi_trace_tiles() sets: the meshes of texels, and of those that shot rays of shared AO places
 * and normals. A texel is its first sample's. */
static void note_samples(void *user, const vshi_samples *samples) {
    vshi_page *page = user;
    for (size_t i = samples->count; i-- > 0;) {
        const size_t place = vshi_page_place(page, samples->texel[i]);
        page->mesh[place] = vshi_sample_mesh(samples, i) + 1;
        if ((page->ao.level != NULL && page->ao.level[place] != 0) ||
            (page->sky.level != NULL && page->sky.level[place] != 0)) {
            vshi_page_note(page, samples, i);
        }
    }
}

vsh_result vshi_page_rasterize(vshi_page *page, size_t number, vsh_error *error) {
    return vshi_tile_visit(page->charts, number, page->charts->tangents, note_samples, page, error);
}
