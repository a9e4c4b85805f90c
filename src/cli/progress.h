/* Progress on standard error: the stage, how much of it is done, and about how long the rest of it takes. */
#ifndef CLI_PROGRESS_H
#define CLI_PROGRESS_H

#include <stdbool.h>
#include <vdbshade/base.h>

/* Decides whether progress is shown: `wanted` shows it anywhere, else it is shown on a terminal only. `quiet`
 * silences it. */
void cli_progress_begin(bool wanted, bool quiet);

/* For vsh_run: show, and stop where the user interrupted. */
int32_t cli_progress_report(void *user, const char *stage, double fraction);

/* Writes "vdbshade: LINE", clear of the progress that may stand on the terminal. Any thread. */
void cli_progress_line(const char *line);

/* Clears what stands on the terminal. */
void cli_progress_end(void);

#endif
