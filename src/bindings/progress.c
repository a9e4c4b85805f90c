/* Progress for languages whose callbacks take long. */
#include "base/clock.h"

#include <vdbshade/base.h>

#include <pthread.h>

/* Called by one thread at a time (vsh_progress_fn), so that nothing here is locked. */
int32_t vsh_progress_seldom(void *given, const char *stage, double fraction) {
    vsh_progress_filter *filter = given;
    if (filter == NULL || filter->progress == NULL || filter->answered != 0) {
        return filter != NULL ? filter->answered : 0;
    }
    if (filter->thread != 0 && filter->thread != (uint64_t)pthread_self()) {
        return 0;
    }
    const double now = vshi_seconds();
    if (fraction <= 0.0 || fraction >= 1.0 || now - filter->last >= filter->seconds) {
        filter->answered = filter->progress(filter->user, stage, fraction);
        filter->last = vshi_seconds(); /* the callback's own time counts as nobody's */
    }
    return filter->answered;
}
