#include "closeness.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>

void cli_closeness_warn(const cli_receiver_job *job, const vsh_uv_report *reports) {
    const vsh_receiver *receiver = &job->scene->receivers[job->index];
    vsh_run run = *job->run;
    run.warning = NULL;
    vsh_closeness close;
    vsh_error error;
    for (size_t m = 0; m < job->mesh_count; ++m) {
        if (reports[m].overlap_texels > 0) {
            return;
        }
    }
    if (vsh_charts_closeness(job->meshes, job->mesh_count, receiver->width, receiver->height, &run, &close,
                             &error) != VSH_OK ||
        close.texels == 0) {
        return; /* no more than a hint: nothing is refused for the want of it */
    }
    const double larger = receiver->width > receiver->height ? receiver->width : receiver->height;
    const double apart = close.gap > 0.0 ? ceil(larger / close.gap) : INFINITY;
    const char *name = job->meshes[close.mesh].name;
    char line[1024], help[128];
    if (apart <= VSH_MAX_LIGHTMAP_SIZE) {
        snprintf(help, sizeof help, "from --size %.0f on they are apart", apart);
    } else {
        snprintf(help, sizeof help, "they touch, so no size parts them; unwrap with a margin");
    }
    snprintf(line, sizeof line,
             "%s: charts lie closer than a texel to each other along %" PRIu64 " texels, %" PRIu64
             " of them of mesh '%s': values bleed between them; %s",
             receiver->path, close.texels, close.mesh_texels, name != NULL ? name : "", help);
    job->run->warning(job->run->user, line);
}
