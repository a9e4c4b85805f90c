/* Statistics of bands, parts and jobs, added up. */
#include "bake_scene/job.h"

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
