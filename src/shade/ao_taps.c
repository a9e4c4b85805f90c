/* Ambient occlusion by five samples along the normal: what the surface comes nearer than an open plane would
 * (Quilez). Tuned by eye; too dark in corners. */
#include "shade/ao.h"

#include <math.h>

void vshi_ao_taps(const void *user, size_t begin, size_t end, vsh_shade_stats *stats) {
    const vshi_ao_task *task = user;
    /* his scene's distances 0.01 … 0.13 stand for the AO distance */
    static const double FIRST = 0.01, LAST = 0.13, FADE = 0.95, STRENGTH = 3.0;
    const double unit = task->distance / LAST;
    const double reach = (double)task->field->levels[task->field->level_count - 1].band;
    for (size_t i = begin; i < end; ++i) {
        vshi_ao_frame frame;
        if (!vshi_ao_frame_at(task, i, &frame, stats)) {
            continue;
        }
        double occlusion = 0.0, weight = 1.0;
        for (int tap = 0; tap < 5; ++tap) {
            const double h = FIRST + (LAST - FIRST) * tap / 4.0;
            const vshi_vec p = vshi_add(frame.origin, vshi_scale(frame.axes[2], h * unit));
            const float at[3] = {(float)p.x, (float)p.y, (float)p.z};
            /* beyond the coarsest band only the band is known: a bound from below, which tells of no occluder
             */
            const double distance = (double)vshi_field_distance(task->field, at);
            const bool beyond = distance >= reach && h * unit > reach;
            stats->beyond_reach += beyond;
            occlusion += beyond ? 0.0 : weight * (h - fmin(h, distance / unit));
            weight *= FADE;
        }
        stats->samples += 5;
        const double open = 1.0 - STRENGTH * occlusion;
        task->ao[i] = (float)(open < 0.0 ? 0.0 : open);
    }
}
