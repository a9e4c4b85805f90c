/* Rows that go into image files. */
#ifndef VSHI_FILE_SINK_H
#define VSHI_FILE_SINK_H

#include "bake_scene/job.h"

typedef struct vshi_file_sink {
    const vsh_bake_job *job;
    const vsh_run *run; /* that is warned of light that integers cut */
    const char *output;
    vsh_image_writer *writer;
} vshi_file_sink;

/* A sink of `files`, which must outlive it. */
vsh_row_sink vshi_file_sink_of(vshi_file_sink *files);

#endif
