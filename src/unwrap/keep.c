
#include "base/memory.h"
#include "base/try.h"
#include "mesh/weld.h"
#include "unwrap/patch.h"

#include <stdlib.h>

static const char what[] = "charts of UVs";

static bool in_square(const float *uvs, const uint32_t *corner) {
    for (int k = 0; k < 3; ++k) {
        const float *uv = uvs + 2 * (size_t)corner[k];
        if (!(uv[0] >= 0.0F && uv[0] <= 1.0F && uv[1] >= 0.0F && uv[1] <= 1.0F)) {
            return false;
        }
    }
    return true;
}

/* 1: the triangle runs anticlockwise, -1: clockwise, 0: it has no area. */
static int sense(const float *uvs, const uint32_t *corner) {
    const float *a = uvs + 2 * (size_t)corner[0], *b = uvs + 2 * (size_t)corner[1],
                *c = uvs + 2 * (size_t)corner[2];
    const double area = ((double)b[0] - (double)a[0]) * ((double)c[1] - (double)a[1]) -
                        ((double)b[1] - (double)a[1]) * ((double)c[0] - (double)a[0]);
    return area > 0.0 ? 1 : area < 0.0 ? -1 : 0;
}

/* Fills a patch's uv; where all run clockwise, mirrored. */
static void take_uvs(vshi_patch *p, bool mirrored, double scale) {
    const vsh_mesh *mesh = p->surface->mesh;
    for (uint32_t i = 0; i < p->count; ++i) {
        for (uint32_t k = 0; k < 3; ++k) {
            const float *uv = mesh->uvs + 2 * (size_t)mesh->indices[3 * (size_t)p->triangles[i] + k];
            double *to = p->uv[p->corner[i][k]];
            to[0] = scale * (mirrored ? 1.0 - (double)uv[0] : (double)uv[0]);
            to[1] = scale * (double)uv[1];
        }
    }
}

static double flat_area(const vshi_patch *p) {
    double sum = 0.0;
    for (uint32_t i = 0; i < p->count; ++i) {
        sum += 0.5 * vshi_patch_doubled_area(p, i);
    }
    return sum;
}

/* Numbers the parts of a patch that hang together, by their first triangles: part[count]. */
static uint32_t find_parts(const vshi_patch *p, uint32_t *part) {
    uint32_t parts = 0;
    for (uint32_t i = 0; i < p->count; ++i) {
        part[i] = i;
    }
    for (uint32_t side = 0; side < 3 * p->count; ++side) {
        if (p->beyond[side] != VSHI_NONE) {
            vshi_set_join(part, side / 3, p->beyond[side] / 3);
        }
    }
    for (uint32_t i = 0; i < p->count; ++i) {
        part[i] = vshi_set_of(part, i);
    }
    for (uint32_t i = 0; i < p->count; ++i) { /* the first of a part stands before the others */
        part[i] = part[i] == i ? parts++ : part[part[i]];
    }
    return parts;
}

static vsh_result add_parts(const vshi_patch *whole, bool mirrored, vshi_patches *patches, vsh_error *error) {
    uint32_t *part = NULL, *begin = NULL, *list = NULL, parts = 0;
    const double scale = sqrt(whole->area / flat_area(whole));
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&part, whole->count, sizeof *part, what, error));
    parts = find_parts(whole, part);
    VSHI_TRY_DONE(vshi_allocate((void **)&begin, (size_t)parts + 2, sizeof *begin, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&list, whole->count, sizeof *list, what, error));
    vshi_list_groups(part, whole->count, parts, begin, list);
    for (uint32_t k = 0; k < parts; ++k) {
        const uint32_t count = begin[k + 1] - begin[k];
        uint32_t *triangles = NULL;
        vshi_patch patch;
        VSHI_TRY_DONE(vshi_allocate((void **)&triangles, count, sizeof *triangles, what, error));
        for (uint32_t i = 0; i < count; ++i) {
            triangles[i] = whole->triangles[list[begin[k] + i]];
        }
        result = vshi_patch_make(whole->surface, triangles, count, &patch, error);
        if (result != VSH_OK) {
            vshi_patch_free(&patch);
            goto done;
        }
        take_uvs(&patch, mirrored, 1.0);
        vshi_flatten_measure(&patch); /* its stretch, which its size is no part of */
        take_uvs(&patch, mirrored, scale);
        patch.kept = true;
        VSHI_TRY_DONE(vshi_patches_add(patches, &patch, error));
    }
done:
    free(list);
    free(begin);
    free(part);
    return result;
}

vsh_result vshi_keep_charts(const vshi_cut_mesh *s, vshi_patches *patches, bool *usable, vsh_error *error) {
    const vsh_mesh *mesh = s->mesh;
    int senses = 0;
    uint32_t count = 0;
    *usable = false;
    for (uint32_t i = 0; i < s->count && mesh->uvs != NULL; ++i) {
        if (s->area[i] == 0.0) {
            continue;
        }
        const int own = sense(mesh->uvs, mesh->indices + 3 * (size_t)i);
        if (!in_square(mesh->uvs, mesh->indices + 3 * (size_t)i) || own == 0 ||
            (count > 0 && own != senses)) {
            return VSH_OK;
        }
        senses = own;
        ++count;
    }
    if (count == 0) {
        return VSH_OK;
    }
    uint32_t *triangles = NULL;
    vshi_patch whole;
    bool overlaps = true;
    VSHI_TRY(vshi_allocate((void **)&triangles, count, sizeof *triangles, what, error));
    count = 0;
    for (uint32_t i = 0; i < s->count; ++i) {
        if (s->area[i] > 0.0) {
            triangles[count++] = i;
        }
    }
    vsh_result result;
    VSHI_TRY_DONE(vshi_patch_make(s, triangles, count, &whole, error));
    take_uvs(&whole, senses < 0, 1.0);
    whole.kept = true; /* of many parts, each with a border of its own */
    VSHI_TRY_DONE(vshi_patch_overlaps(&whole, &overlaps, error));
    *usable = !overlaps;
    if (*usable && patches != NULL) {
        VSHI_TRY_DONE(add_parts(&whole, senses < 0, patches, error));
    }
done:
    vshi_patch_free(&whole);
    return result;
}
