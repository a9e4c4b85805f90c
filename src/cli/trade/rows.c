/* The table as CSV: what the page shows, with every digit. */
#include "parts.h"

#include <inttypes.h>
#include <math.h>

/* covered: texels under charts; invalid: of them, those that a bake of this voxel size marks so; left_out:
 * valid ones that are invalid at another of the voxel sizes; texels: the rest, measured, the same in all
 * rows. */
static const char names[] = "subject,method,options,resolution,build_s,bake_s,us_per_value,bytes,covered,"
                            "invalid,left_out,texels,rmse,"
                            "penumbra_rmse,bias,p95,p99,max,width_error,certified,front,valid_rmse\n";

void trade_rows_write(FILE *out, const void *user) {
    const trade_work *work = user;
    fputs(names, out);
    for (size_t s = 0; s < work->subject_count; ++s) {
        const trade_subject *subject = &work->subjects[s];
        for (size_t i = 0; i < subject->run_count; ++i) {
            const trade_run *r = &subject->runs[i];
            const trade_metrics *m = &r->metrics;
            fprintf(out, "%s,%s,%s,%d,%.6g,%.6g,%.6g,%" PRIu64 ",%zu,%zu,%zu,%zu,", subject->name, r->method,
                    r->options, r->resolution, r->build_s, r->bake_s, r->rate, r->bytes, work->covered,
                    work->covered - r->valid, r->valid - work->common_count, work->common_count);
            fprintf(out, "%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,", m->rmse, m->penumbra_rmse, m->bias, m->p95, m->p99,
                    m->max);
            fprintf(out, isnan(m->width_error) ? "," : "%.6f,", m->width_error);
            fprintf(out, isnan(r->certified) ? "," : "%.6f,", r->certified);
            fprintf(out, "%d,%.6f\n", r->front, r->valid_rmse);
        }
    }
}
