/* Statistics of bands, parts and jobs, added up. */
#include "bake_scene/job.h"
#include "base/error.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/try.h"

#include <math.h>

void vshi_add_shade(vsh_shade_stats *sum, const vsh_shade_stats *baked) {
    sum->marches += baked->marches;
    sum->samples += baked->samples;
    sum->skipped += baked->skipped;
    sum->certified += baked->certified;
    sum->unfinished += baked->unfinished;
    sum->invalid += baked->invalid;
    sum->beyond_reach += baked->beyond_reach;
    sum->rays += baked->rays;
    sum->refined += baked->refined;
    sum->square_error += baked->square_error;
    sum->ao_square_error += baked->ao_square_error;
    sum->worst_error = fmax(sum->worst_error, baked->worst_error);
}

void vshi_add_bake_error(vsh_bake_error *sum, const vsh_bake_error *more) {
    sum->values += more->values;
    sum->square_error += more->square_error;
    sum->held += more->held;
    sum->held_square_error += more->held_square_error;
    sum->worst = fmax(sum->worst, more->worst);
}

static uint64_t most(uint64_t a, uint64_t b) {
    return a > b ? a : b;
}

static void add_occluders(vsh_occluders_info *sum, const vsh_occluders_info *more) {
    const vsh_occluders_info before = *sum;
    *sum = *more;
    sum->active_voxels = most(before.active_voxels, more->active_voxels);
    sum->grid_bytes = most(before.grid_bytes, more->grid_bytes);
    sum->bricks = most(before.bricks, more->bricks);
    sum->field_bytes = most(before.field_bytes, more->field_bytes);
    sum->triangles_bytes = most(before.triangles_bytes, more->triangles_bytes);
    sum->voxelize_s += before.voxelize_s;
    sum->field_s += before.field_s;
    sum->triangles_s += before.triangles_s;
}

static void add_report(vsh_bake_report *sum, const vsh_bake_report *more, vsh_bake_error *errors) {
    sum->load_s += more->load_s;
    sum->bake_s += more->bake_s;
    sum->write_s += more->write_s;
    sum->texels += more->texels;
    sum->invalid_texels += more->invalid_texels;
    sum->bands += more->bands;
    vshi_add_shade(&sum->shade, &more->shade);
    add_occluders(&sum->occluders, &more->occluders);
    if (more->errors != NULL) {
        for (size_t i = 0; errors != NULL && i < more->error_count; ++i) {
            vshi_add_bake_error(&errors[i], &more->errors[i]);
        }
        sum->errors = errors;
        sum->error_count = errors != NULL ? more->error_count : 0;
    }
}

vsh_result vsh_bake_report_add_sized(vsh_bake_report *sum, const vsh_bake_report *more, size_t report_size,
                                     vsh_bake_error *errors, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(sum);
    VSHI_NEEDS(more);
    vsh_bake_report to, from;
    vshi_give(&to, sizeof to, sum, report_size);
    vshi_give(&from, sizeof from, more, report_size);
    if (to.error_count > 0 && from.error_count > 0 && to.error_count != from.error_count) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "reports of %zu and %zu errors: jobs of different lights",
                         to.error_count, from.error_count);
    }
    add_report(&to, &from, errors);
    vshi_give(sum, report_size, &to, sizeof to);
    return VSH_OK;
}
