/* A field of a file as it would have been made. */
#include "base/floats.h"
#include "base/memory.h"
#include "base/try.h"
#include "field/stored.h"
#include "field/surface.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The levels below the first that reaches so many finest voxels, and it, are those that a field of that reach
 * has: none depends on those above. */
static vsh_result cut_levels(const vsh_field_file *file, vsh_field *f, double reach, vsh_error *error) {
    int32_t count = 1;
    while (count < f->level_count && f->levels[count - 1].band < reach) {
        ++count;
    }
    const double most = f->levels[count - 1].band;
    if (most < reach && count < VSHI_MAX_LEVELS) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: its field reaches %g, the lights, AO and receivers here ask for %g", file->path,
                         most * f->voxel_size, reach * f->voxel_size);
    }
    f->value_count = count < f->level_count ? f->levels[count].first_value : f->value_count;
    f->level_count = count;
    return VSH_OK;
}

/* Of a copy of the finest level's values: quads are counted first and written then, and the file's may change
 * between. */
static vsh_result add_surface(vsh_field *f, const vsh_run *run, vsh_error *error) {
    const uint64_t count = f->level_count > 1 ? f->levels[1].first_value : f->value_count;
    const double held = vshi_field_bytes(f) + (double)count * sizeof(int16_t);
    int16_t *mapped = f->values, *values = NULL;
    vshi_job *job = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_check_limit(run, held, "surface", error));
    VSHI_TRY_DONE(
        vshi_take_pages((void **)&values, (size_t)count * sizeof *values, "values of a field", error));
    memcpy(values, mapped, (size_t)count * sizeof *values);
    job = vshi_job_begin(run, "field", 100);
    if (job == NULL) {
        VSHI_TRY_DONE(vshi_fail(error, VSH_ERROR_MEMORY, "field: the system refused memory"));
    }
    f->values = values;
    result = vshi_field_add_surface(f, (vshi_budget){run, held}, job, error);
    f->values = mapped;
done:
    vshi_job_end(job);
    free(values);
    return result;
}

vsh_result vsh_field_file_field(const vsh_field_file *file, size_t index, const vsh_field_options *options,
                                const vsh_run *run, vsh_field **field, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(field);
    *field = NULL;
    VSHI_NEEDS(file);
    vsh_field_options o = vsh_field_options_default();
    vsh_run full;
    VSHI_TRY(vshi_options_resolve(options, &o, sizeof o, "vsh_field_options", error));
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    if (index >= file->count) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: field %zu: there are %zu", file->path, index,
                         file->count);
    }
    VSHI_TRY(vshi_field_reach_check(o.reach, error));
    vsh_field *f = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&f, 1, sizeof *f, "field", error));
    *f = file->fields[index];
    f->borrowed = true;
    VSHI_TRY_DONE(cut_levels(file, f, vshi_field_reach(f, o.reach), error));
    VSHI_TRY_DONE(vshi_check_limit(&full, vshi_field_bytes(f), "field", error));
    f->grown = o.grown;
    if (o.surface != 0 && vsh_triangles_available()) {
        VSHI_TRY_DONE(add_surface(f, &full, error));
    }
    *field = f;
    f = NULL;
done:
    vsh_field_free(f);
    return result;
}
