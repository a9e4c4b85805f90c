/* The band of the level set that a field of a file was made from. */
#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"
#include "field/level.h"
#include "field/stored.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* How far a voxel of the lattice may be off the field's: doubles are as coarse 10^12 voxels from the origin.
 */
static const double OFF = 0.01;

bool vshi_band_fits(const vsh_field *field, const vsh_voxels *band) {
    const vshi_level *level = &field->levels[0];
    vsh_voxels_info info;
    vsh_voxels_get_info(band, &info);
    bool fits = info.has_normals != 0;
    for (int axis = 0; axis < 3; ++axis) {
        const int64_t end = (int64_t)level->origin[axis] + VSHI_BRICK_CELLS * (int64_t)level->size[axis];
        fits = fits && info.index_min[axis] >= level->origin[axis] && info.index_max[axis] < end;
    }
    for (int corner = 0; corner < 8 && fits; ++corner) {
        int32_t index[3];
        double at[3];
        for (int axis = 0; axis < 3; ++axis) {
            index[axis] = (corner >> axis & 1) != 0 ? info.index_max[axis] : info.index_min[axis];
        }
        vsh_voxels_centre(band, index, at);
        const vshi_vec p = vshi_to_field(field, at);
        fits = fabs(p.x - index[0]) <= OFF && fabs(p.y - index[1]) <= OFF && fabs(p.z - index[2]) <= OFF;
    }
    return fits;
}

/* Whether a band is all of a level set's, as its floats are compared. */
static vsh_result check_width(const vsh_field_file *file, size_t index, double band, vsh_error *error) {
    const vsh_kept_field *kept = &file->kept[index];
    const double widest = kept->half_width, voxel = file->fields[index].voxel_size;
    if (!(band >= 0.0 && band <= widest * (1.0 + 1e-6))) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "band of %g voxels: expected 0 … %g, the half width of the level set", band, widest);
    }
    return band == 0.0 || (float)(band * voxel) == (float)(widest * voxel)
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_INPUT,
                           "%s: keeps the level set's band of %g voxels as a whole, and none of %g",
                           file->path, widest, band);
}

/* Each number and mask is read once, and what was read is checked. */
static vsh_result copy_blocks(const vsh_field_file *file, size_t index, vshi_block *blocks,
                              vsh_error *error) {
    const vshi_stored_band *band = &vshi_stored_record(file->head, index)->band;
    const vshi_level *level = &file->fields[index].levels[0];
    const uint64_t all = (uint64_t)level->size[0] * (uint64_t)level->size[1] * (uint64_t)level->size[2];
    uint64_t next = 0;
    for (size_t i = 0; i < band->block_count; ++i) {
        uint32_t number;
        uint64_t any = 0;
        memcpy(&number, file->mapped + band->blocks_at + i * sizeof number, sizeof number);
        memcpy(blocks[i].mask, file->mapped + band->masks_at + i * sizeof blocks->mask, sizeof blocks->mask);
        for (int k = 0; k < VSHI_MASK_WORDS; ++k) {
            any |= blocks[i].mask[k];
        }
        if (number < next || number >= all || any == 0) {
            return vshi_fail(error, VSH_ERROR_READ, "%s: damaged: field %zu: a block of its band is none",
                             file->path, index);
        }
        next = (uint64_t)number + 1;
        vshi_block_corner(level->origin, level->size, number, blocks[i].origin);
    }
    return VSH_OK;
}

static vsh_result take_band(const vsh_field_file *file, size_t index, const vsh_run *run, vsh_voxels **voxels,
                            vsh_error *error) {
    const vshi_stored_band *band = &vshi_stored_record(file->head, index)->band;
    const double bytes = (double)band->block_count * sizeof(vshi_block);
    vshi_block *blocks = NULL;
    vsh_voxels *made = NULL;
    vsh_error why = {VSH_OK, ""};
    vsh_result result;
    VSHI_TRY_DONE(vshi_check_limit(run, 2.0 * bytes, "band", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&blocks, (size_t)band->block_count, sizeof *blocks,
                                "blocks of a band", error));
    VSHI_TRY_DONE(copy_blocks(file, index, blocks, error));
    result = vshi_voxels_of_blocks(&band->map, blocks, (size_t)band->block_count, "band", run, &made, &why);
    if (result == VSH_ERROR_INPUT || (result == VSH_OK && !vshi_band_fits(&file->fields[index], made))) {
        result = vshi_fail(error, VSH_ERROR_READ, "%s: damaged: field %zu: %s", file->path, index,
                           result != VSH_OK ? why.message : "its band is on another lattice");
    } else if (result != VSH_OK) {
        result = vshi_fail(error, result, "%s", why.message);
    } else {
        *voxels = made;
        made = NULL;
    }
done:
    vsh_voxels_free(made);
    free(blocks);
    return result;
}

vsh_result vsh_field_file_band(const vsh_field_file *file, size_t index, double band, const vsh_run *run,
                               vsh_voxels **voxels, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(voxels);
    *voxels = NULL;
    VSHI_NEEDS(file);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    if (index >= file->count) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: field %zu: there are %zu", file->path, index,
                         file->count);
    }
    if (file->kept[index].band_bytes == 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: field %zu: its level set's band was not kept",
                         file->path, index);
    }
    VSHI_TRY(check_width(file, index, band, error));
    vshi_job *job = vshi_job_begin(&full, "band", 1);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "band: the system refused memory");
    }
    vsh_result result = vshi_job_cancelled(job) ? vshi_job_fail_cancelled(job, error)
                                                : take_band(file, index, &full, voxels, error);
    if (result == VSH_OK && vshi_job_advance(job, 1)) {
        vsh_voxels_free(*voxels);
        *voxels = NULL;
        result = vshi_job_fail_cancelled(job, error);
    }
    vshi_job_end(job);
    return result;
}
