#include "bake/samples.h"

#include "base/memory.h"
#include "base/try.h"

#include <string.h>

vsh_result vshi_samples_take(vsh_texels *texels, bool tangents, vsh_error *error) {
    const char *what = "texels";
    VSHI_TRY(vshi_allocate((void **)&texels->position, texels->count, 3 * sizeof(double), what, error));
    VSHI_TRY(vshi_allocate((void **)&texels->normal, texels->count, 3 * sizeof(float), what, error));
    VSHI_TRY(vshi_allocate((void **)&texels->geometric, texels->count, 3 * sizeof(float), what, error));
    VSHI_TRY(vshi_allocate((void **)&texels->lift, texels->count, 3 * sizeof(float), what, error));
    VSHI_TRY(vshi_allocate((void **)&texels->texel, texels->count, sizeof(uint32_t), what, error));
    VSHI_TRY(vshi_allocate((void **)&texels->mesh, texels->count, sizeof(uint32_t), what, error));
    VSHI_TRY(vshi_allocate((void **)&texels->tangent, tangents ? texels->count : 0, 4 * sizeof(float), what,
                           error));
    return VSH_OK;
}

static void set_tangent(vshi_sample_writer *w, const vsh_mesh *mesh, size_t triangle) {
    double handedness;
    const vshi_vec t = vshi_surface_tangent(mesh, triangle, &handedness);
    w->tangent[0] = (float)t.x;
    w->tangent[1] = (float)t.y;
    w->tangent[2] = (float)t.z;
    w->tangent[3] = (float)handedness;
}

static void write_sample(vshi_sample_writer *w, uint32_t number, uint32_t texel, const double weight[3],
                         bool border) {
    vsh_texels *texels = w->texels;
    const uint32_t mesh = w->work->mesh[number - 1];
    if (number != w->number) {
        const vsh_mesh *of = &w->charts->sorted.meshes[mesh];
        vshi_surface_set(of, w->work->local[number - 1], &w->surface);
        if (texels != NULL && texels->tangent != NULL) {
            set_tangent(w, of, w->work->local[number - 1]);
        }
        w->number = number;
    }
    vshi_vec position, normal, lift;
    vshi_surface_at(&w->surface, weight, &position, &normal, &lift);
    const double p[3] = {position.x, position.y, position.z};
    const double n[3] = {normal.x, normal.y, normal.z};
    const double up[3] = {lift.x, lift.y, lift.z};
    const double g[3] = {w->surface.geometric.x, w->surface.geometric.y, w->surface.geometric.z};
    for (size_t k = 0; w->box != NULL && k < 3; ++k) {
        w->box->low[k] = p[k] < w->box->low[k] ? p[k] : w->box->low[k];
        w->box->high[k] = p[k] > w->box->high[k] ? p[k] : w->box->high[k];
    }
    if (texels == NULL) {
        return;
    }
    const size_t i = w->next++;
    for (size_t k = 0; k < 3; ++k) {
        texels->position[3 * i + k] = p[k];
        texels->normal[3 * i + k] = (float)n[k];
        texels->geometric[3 * i + k] = (float)g[k];
        texels->lift[3 * i + k] = (float)up[k];
    }
    texels->texel[i] = texel;
    const vsh_charts *charts = w->charts;
    const bool sheet = charts->sheet[charts->sorted.first[mesh] + w->work->local[number - 1]] != 0;
    texels->mesh[i] = mesh | (sheet ? VSHI_SAMPLE_SHEET : 0) | (border ? VSHI_SAMPLE_BORDER : 0);
    if (texels->tangent != NULL) {
        memcpy(texels->tangent + 4 * i, w->tangent, sizeof w->tangent);
    }
}

size_t vshi_samples_write(vshi_sample_writer *w, size_t x, size_t y, uint32_t texel, size_t most) {
    const vshi_tile *tile = &w->work->tile;
    const size_t n = (size_t)w->charts->sorted.raster.supersample, side = VSHI_TILE * n;
    const size_t column = tile->column * VSHI_TILE + x, row = tile->row * VSHI_TILE + y;
    const size_t bit = VSHI_TILE * y + x;
    double weight[3];
    if ((tile->border >> bit) & 1) {
        const uint32_t number = tile->nearest[bit];
        vshi_uv_centroid_near(&w->work->triangle[number - 1], (double)column + 0.5, (double)row + 0.5,
                              weight);
        write_sample(w, number, texel, weight, true);
        return 1;
    }
    size_t count = 0;
    for (size_t s = 0; ((tile->covered >> bit) & 1) != 0 && s < n * n && count < most; ++s) {
        const size_t sx = s % n, sy = s / n;
        const uint32_t number = tile->owner[(y * n + sy) * side + x * n + sx];
        if (number != 0) {
            vshi_uv_barycentric(&w->work->triangle[number - 1],
                                (double)column + ((double)sx + 0.5) / (double)n,
                                (double)row + ((double)sy + 0.5) / (double)n, weight);
            write_sample(w, number, texel, weight, false);
            ++count;
        }
    }
    return count;
}
