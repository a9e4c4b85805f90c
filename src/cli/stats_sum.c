/* Statistics of several bakes together. */
#include "stats.h"

#include "message.h"

#include <math.h>
#include <stdlib.h>

static void add_shade(vsh_shade_stats *sum, const vsh_shade_stats *more) {
    sum->marches += more->marches;
    sum->samples += more->samples;
    sum->skipped += more->skipped;
    sum->certified += more->certified;
    sum->unfinished += more->unfinished;
    sum->invalid += more->invalid;
    sum->beyond_reach += more->beyond_reach;
    sum->rays += more->rays;
    sum->refined += more->refined;
    sum->square_error += more->square_error;
    sum->ao_square_error += more->ao_square_error;
    sum->worst_error = fmax(sum->worst_error, more->worst_error);
}

static void add_error(vsh_bake_error *sum, const vsh_bake_error *more) {
    sum->values += more->values;
    sum->square_error += more->square_error;
    sum->held += more->held;
    sum->held_square_error += more->held_square_error;
    sum->worst = fmax(sum->worst, more->worst);
}

/* What was in memory one after the other is the most of them. */
static void add_casters(vsh_occluders_info *sum, const vsh_occluders_info *more) {
    const vsh_occluders_info last = *sum;
    *sum = *more;
    sum->active_voxels = last.active_voxels > more->active_voxels ? last.active_voxels : more->active_voxels;
    sum->grid_bytes = last.grid_bytes > more->grid_bytes ? last.grid_bytes : more->grid_bytes;
    sum->field_bytes = last.field_bytes > more->field_bytes ? last.field_bytes : more->field_bytes;
    sum->bricks = last.bricks > more->bricks ? last.bricks : more->bricks;
    sum->triangles_bytes =
        last.triangles_bytes > more->triangles_bytes ? last.triangles_bytes : more->triangles_bytes;
}

static int add_errors(cli_stats *sum, const cli_stats *more) {
    const size_t count = more->light_count + 2;
    if (more->errors == NULL) {
        return CLI_OK;
    }
    if (sum->own_errors == NULL) {
        sum->own_errors = calloc(count, sizeof *sum->own_errors);
        sum->errors = sum->own_errors;
        sum->lights = more->lights;
        sum->light_count = more->light_count;
    }
    if (sum->own_errors == NULL) {
        return cli_out_of_memory("statistics");
    }
    for (size_t i = 0; i < count; ++i) {
        add_error(&sum->own_errors[i], &more->errors[i]);
    }
    return CLI_OK;
}

int cli_stats_add(cli_stats *sum, const cli_stats *more) {
    for (int i = 0; i < CLI_STAGE_COUNT; ++i) {
        sum->seconds[i] += more->seconds[i];
    }
    sum->texels += more->texels;
    sum->invalid_texels += more->invalid_texels;
    sum->resumed_rows += more->resumed_rows;
    sum->bands += more->bands;
    const bool first = sum->world_tiles++ == 0;
    sum->ao_spacing = first || more->ao_spacing < sum->ao_spacing ? more->ao_spacing : sum->ao_spacing;
    for (int i = 0; i < CLI_STATS_KINDS; ++i) {
        sum->methods[i] = more->methods[i];
    }
    sum->max_error = more->max_error;
    add_shade(&sum->shade, &more->shade);
    add_casters(&sum->casters, &more->casters);
    return add_errors(sum, more);
}

void cli_stats_free_sum(cli_stats *sum) {
    free(sum->own_errors);
    sum->own_errors = NULL;
    sum->errors = NULL;
}
