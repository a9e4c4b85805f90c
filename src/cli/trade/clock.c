/* Time, as runs are measured by. */
#include "base/clock.h"
#include "trade.h"

#include <stdlib.h>
#include <time.h>

/* With one thread it is the processor's time, so that other work on the machine does not show. */
double trade_now(const trade_work *work) {
    if (work->run.threads != 1) {
        return vshi_seconds();
    }
    struct timespec now = {0, 0};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

double trade_left(const trade_work *work) {
    return work->settings->budget - (vshi_seconds() - work->measuring);
}

bool trade_again(const trade_clock *clock) {
    return clock->count < TRADE_REPEATS && clock->times[0] < TRADE_SHORT_SECONDS;
}

static int by_value(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double trade_median(trade_clock *clock) {
    qsort(clock->times, (size_t)clock->count, sizeof clock->times[0], by_value);
    return clock->times[clock->count / 2];
}
