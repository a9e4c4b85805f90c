/* A lightmap's texels by a few of them, far apart. */
#include "bake/samples.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"

#include <stdlib.h>
#include <string.h>

typedef struct sparse {
    const vsh_charts *charts;
    vsh_texels *texels;
    size_t step;    /* tiles */
    uint8_t *taken; /* [columns × rows, up to whole tiles]: by place, 1 where there is a sample */
    _Atomic vsh_result row_result; /* of the rows that failed */
} sparse;

/* Rows of samples, each by itself. */
static void write_sparse(void *user, size_t begin, size_t end) {
    sparse *some = user;
    const vshi_charts *sorted = &some->charts->sorted;
    const size_t columns = (size_t)some->texels->info.width;
    for (size_t row = begin; row < end; ++row) {
        vshi_row work;
        const vsh_result result = vshi_row_open(sorted, row * some->step + some->step / 2, &work, NULL);
        if (result != VSH_OK) {
            atomic_store(&some->row_result, result);
        }
        vshi_sample_writer w = {.charts = some->charts, .texels = some->texels, .work = &work};
        for (size_t column = 0; column < columns && result == VSH_OK; ++column) {
            const size_t of = column * some->step + some->step / 2;
            if (of < work.tiles && work.tile_start[of] != work.tile_start[of + 1]) {
                const size_t place = row * columns + column;
                w.next = place;
                vshi_row_tile(sorted, &work, of, NULL);
                const uint32_t texel = vsh_texel((uint32_t)column, (uint32_t)(VSHI_TILE * row));
                some->taken[place] = vshi_samples_write(&w, 0, 0, texel, 1) > 0;
            }
        }
        vshi_row_close(&work);
    }
}

/* Moves the samples that there are together, and counts those of each row of tiles. */
static void pack_sparse(const uint8_t *taken, size_t places, vsh_texels *texels) {
    const size_t of_row = (size_t)texels->info.width;
    size_t next = 0;
    for (size_t i = 0; i < places; ++i) {
        if (taken[i]) {
            memmove(texels->position + 3 * next, texels->position + 3 * i, 3 * sizeof(double));
            memmove(texels->normal + 3 * next, texels->normal + 3 * i, 3 * sizeof(float));
            memmove(texels->geometric + 3 * next, texels->geometric + 3 * i, 3 * sizeof(float));
            memmove(texels->lift + 3 * next, texels->lift + 3 * i, 3 * sizeof(float));
            texels->texel[next] = texels->texel[i];
            texels->mesh[next++] = texels->mesh[i];
        }
        if ((i + 1) % of_row == 0) {
            texels->row_start[(i + 1) / of_row] = next;
        }
    }
    texels->count = next;
    texels->whole = next;
    texels->info.covered = next;
    texels->info.samples = next;
}

vsh_result vshi_texels_create_sparse(const vsh_charts *charts, int32_t step, const vsh_run *run,
                                     vsh_texels **texels, vsh_error *error) {
    const size_t columns = ((size_t)charts->info.width + (size_t)step / 2 - 1) / (size_t)step;
    const size_t rows = ((size_t)charts->info.height + (size_t)step / 2 - 1) / (size_t)step;
    sparse some = {.charts = charts, .step = (size_t)step / VSHI_TILE};
    vsh_texels *made = NULL;
    *texels = NULL;
    if (columns == 0 || rows == 0) {
        return VSH_OK;
    }
    vsh_result result;
    vshi_job *job = vshi_job_begin(run, "texels", rows);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "texels: the system refused memory");
    }
    VSHI_TRY_DONE(vshi_allocate((void **)&made, 1, sizeof *made, "texels", error));
    made->count = rows * columns;
    made->info.width = (int32_t)columns;
    made->info.height = (int32_t)(VSHI_TILE * rows);
    made->band = (vshi_band){
        .own_end = rows, .held_end = rows, .own_rows = made->info.height, .rows = made->info.height};
    made->ao_spacing = 1;
    made->shade = charts->shade;
    made->smooth = charts->smooth;
    made->mesh_count = charts->sorted.mesh_count;
    VSHI_TRY_DONE(vshi_check_limit(run,
                                   (double)charts->info.bytes +
                                       vshi_row_bytes(&charts->sorted, run->threads) +
                                       (double)made->count * (double)vshi_sample_bytes(false),
                                   "texels", error));
    VSHI_TRY_DONE(
        vshi_allocate((void **)&made->row_start, rows + 1, sizeof *made->row_start, "texels", error));
    VSHI_TRY_DONE(vshi_samples_take(made, false, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&some.taken, made->count, 1, "texels", error));
    some.texels = made;
    VSHI_TRY_DONE(vshi_parallel_for(job, rows, 1, 1, write_sparse, &some, error));
    if (atomic_load(&some.row_result) != VSH_OK) {
        result = vshi_fail(error, some.row_result, "texels: the system refused memory for a row");
        goto done;
    }
    pack_sparse(some.taken, made->count, made);
    *texels = made;
    made = NULL;
done:
    free(some.taken);
    vsh_texels_free(made);
    vshi_job_end(job);
    return result;
}
