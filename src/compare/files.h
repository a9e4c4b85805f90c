/* Parts of a comparison of two files under way. */
#ifndef VSHI_COMPARE_FILES_H
#define VSHI_COMPARE_FILES_H

#include "base/error.h"

#include <stdbool.h>
#include <vdbshade/compare.h>

struct vsh_comparison {
    vsh_channel_comparison *channels;
    size_t channel_count;
    char (*problems)[320]; /* other sizes, channels, units, formats */
    size_t problem_count;
    bool alike;
};

typedef struct vshi_compare_work {
    const char *path[2]; /* golden, new */
    vsh_compare_files_options options;
    vsh_run run;
    vsh_tolerances *tolerances; /* may be NULL */
    vsh_comparison *comparison;
} vshi_compare_work;

/* What a file says of itself. */
typedef struct vshi_texts {
    const vsh_attribute *list;
    size_t count;
} vshi_texts;

/* The channels of two images, and the grids of two .vdb files. */
vsh_result vshi_compare_images(vshi_compare_work *work, vsh_error *error);
vsh_result vshi_compare_grids(vshi_compare_work *work, vsh_error *error);

/* Adds what is not alike without being values. */
vsh_result vshi_compare_problem(const vshi_compare_work *work, vsh_error *error, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Adds a channel, zeroed, with the limits that hold for its name, of files that say this of themselves.
 * Earlier pointers are then void. */
vsh_result vshi_compare_channel(const vshi_compare_work *work, const char *name, const vshi_texts texts[2],
                                vsh_channel_comparison **channel, vsh_error *error);

/* Measures and judges. */
vsh_result vshi_compare_measure(const vshi_compare_work *work, vsh_channel_comparison *channel,
                                const vsh_compared *compared, vsh_error *error);

#endif
