/* Parts of a comparison under way. */
#ifndef CLI_COMPARISON_PARTS_H
#define CLI_COMPARISON_PARTS_H

#include "comparison.h"

typedef struct compare_work {
    const cli_compare_settings *settings;
    vsh_run run;
    vsh_tolerances *tolerances; /* may be NULL */
    cli_comparison *comparison;
} compare_work;

/* The channels of two images, and the grids of two .vdb files. CLI_OK or an exit code, having said why. */
int compare_images(compare_work *work);
int compare_grids(const compare_work *work);

/* What a file says of itself. */
typedef struct compare_texts {
    const vsh_attribute *list;
    size_t count;
} compare_texts;

/* A new channel, zeroed; earlier pointers are then void. NULL where memory is short. */
cli_channel *cli_comparison_add(cli_comparison *comparison, const char *name);

/* The limits that hold for the channel of its name, of files that say this of themselves. */
void cli_channel_set_limits(const compare_work *work, const compare_texts texts[2], cli_channel *channel);

/* Measures and judges, and makes the pictures where a page is asked for. */
int cli_channel_measure(const compare_work *work, cli_channel *channel, const vsh_compared *compared);

#endif
