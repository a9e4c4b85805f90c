/* Triangles that are what a mask leaves of a mesh. */
#include "mesh/alpha_mask.h"

#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"
#include "mesh/mesh.h"

#include <math.h>
#include <stdlib.h>

/* A piece that is cut this often is kept as it is: by then its sides are 2^-40 of the triangle's. */
enum { DEEPEST = 120 };

typedef struct corner {
    vshi_vec at; /* the mesh's own space */
    vshi_mask_place place;
} corner;

typedef struct piece {
    corner corners[3];
    int depth;
} piece;

typedef struct cutting {
    const vsh_mesh *mesh;
    vshi_mask_table table;
    double size;
    double most; /* pieces */
    uint64_t count, looked;
    vshi_job *job;
    float *positions; /* NULL: pieces are only counted */
} cutting;

static corner middle(const corner *a, const corner *b) {
    return (corner){vshi_scale(vshi_add(a->at, b->at), 0.5),
                    {0.5 * (a->place.x + b->place.x), 0.5 * (a->place.y + b->place.y)}};
}

/* Squared length of the side from corner k on, world units. */
static double side(const cutting *c, const piece *p, int k) {
    const vshi_vec off = vshi_sub(p->corners[(k + 1) % 3].at, p->corners[k].at);
    const double *m = c->mesh->transform;
    const vshi_vec world = m == NULL ? off
                                     : (vshi_vec){m[0] * off.x + m[1] * off.y + m[2] * off.z,
                                                  m[4] * off.x + m[5] * off.y + m[6] * off.z,
                                                  m[8] * off.x + m[9] * off.y + m[10] * off.z};
    return vshi_dot(world, world);
}

static void keep(cutting *c, const piece *p) {
    if (c->positions != NULL) {
        float *to = c->positions + 9 * c->count;
        for (int k = 0; k < 3; ++k) {
            const vshi_vec at = p->corners[k].at;
            *to++ = (float)at.x;
            *to++ = (float)at.y;
            *to++ = (float)at.z;
        }
    }
    ++c->count;
}

/* False where there are too many, or the job is cancelled. */
static bool cut_triangle(cutting *c, size_t triangle) {
    enum { OFTEN = 1 << 16 };
    piece stack[DEEPEST + 1];
    int left = 1;
    stack[0].depth = 0;
    for (size_t k = 0; k < 3; ++k) {
        const size_t vertex = c->mesh->indices[3 * triangle + k];
        stack[0].corners[k] = (corner){vshi_vec_off(c->mesh->positions + 3 * vertex),
                                       vshi_alpha_mask_place(c->mesh->mask, c->mesh->mask_uvs + 2 * vertex)};
    }
    while (left > 0) {
        const piece p = stack[--left];
        if (++c->looked % OFTEN == 0 && ((double)c->count > c->most || vshi_job_advance(c->job, 0))) {
            return false;
        }
        const vshi_mask_place places[3] = {p.corners[0].place, p.corners[1].place, p.corners[2].place};
        const vshi_mask_cover cover = vshi_mask_table_cover(&c->table, places);
        if (cover == VSHI_MASK_CLEAR) {
            continue;
        }
        double longest = -1.0;
        int at = 0;
        for (int k = 0; k < 3; ++k) {
            const double square = side(c, &p, k);
            at = square > longest ? k : at;
            longest = square > longest ? square : longest;
        }
        if (cover == VSHI_MASK_OPAQUE || !(longest > c->size * c->size) || p.depth == DEEPEST) {
            keep(c, &p);
            continue;
        }
        const corner *a = &p.corners[at], *b = &p.corners[(at + 1) % 3], *o = &p.corners[(at + 2) % 3];
        const corner m = middle(a, b);
        stack[left++] = (piece){{*a, m, *o}, p.depth + 1};
        stack[left++] = (piece){{m, *b, *o}, p.depth + 1};
    }
    return (double)c->count <= c->most && !vshi_job_advance(c->job, 1);
}

static vsh_result cut_all(cutting *c, vsh_error *error) {
    c->count = 0;
    for (size_t i = 0; i < c->mesh->triangle_count; ++i) {
        if (vshi_mesh_degenerate(c->mesh, i) || cut_triangle(c, i)) {
            continue;
        }
        return vshi_job_cancelled(c->job)
                   ? vshi_job_fail_cancelled(c->job, error)
                   : vshi_fail(error, VSH_ERROR_LIMIT,
                               "%s: what its alpha mask leaves is more than %.0f pieces of %.3g",
                               vshi_mesh_label(c->mesh, VSHI_MESH_ALONE).text, c->most, c->size);
    }
    return VSH_OK;
}

vsh_result vshi_mask_pieces_cut(const vsh_mesh *mesh, double size, const vsh_run *run,
                                vshi_mask_pieces *pieces, vsh_error *error) {
    enum { PIECE_BYTES = 9 * sizeof(float) + 3 * sizeof(uint32_t) };
    cutting c = {.mesh = mesh, .size = size, .most = UINT32_MAX / 3};
    const uint64_t memory = run->memory_limit > 0 ? vshi_memory_left(run) : 0;
    c.most = memory > 0 ? fmin(c.most, (double)memory / PIECE_BYTES) : c.most;
    vsh_result result;
    *pieces = (vshi_mask_pieces){.count = 0};
    VSHI_TRY_DONE(vshi_mask_table_create(mesh->mask, run, &c.table, error));
    c.job = vshi_job_begin(run, "masks", 2 * mesh->triangle_count);
    if (c.job == NULL) {
        VSHI_TRY_DONE(vshi_fail(error, VSH_ERROR_MEMORY, "alpha masks: the system refused memory"));
    }
    VSHI_TRY_DONE(cut_all(&c, error));
    const size_t count = (size_t)c.count;
    VSHI_TRY_DONE(vshi_check_limit(run, vshi_mask_table_bytes(mesh->mask) + PIECE_BYTES * (double)count,
                                   "pieces of alpha masks", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&pieces->positions, 9 * count, sizeof *pieces->positions,
                                "pieces of alpha masks", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&pieces->indices, 3 * count, sizeof *pieces->indices,
                                "pieces of alpha masks", error));
    c.positions = pieces->positions;
    if (count > 0) {
        VSHI_TRY_DONE(cut_all(&c, error));
    }
    for (size_t i = 0; i < 3 * count; ++i) {
        pieces->indices[i] = (uint32_t)i;
    }
    pieces->count = count;
done:
    vshi_job_end(c.job);
    vshi_mask_table_free(&c.table);
    return result;
}

void vshi_mask_pieces_free(vshi_mask_pieces *pieces) {
    free(pieces->positions);
    free(pieces->indices);
    *pieces = (vshi_mask_pieces){.count = 0};
}
