/* What the stages of a bake are expected to take, for its progress. */
#ifndef CLI_BAKE_EXPECT_H
#define CLI_BAKE_EXPECT_H

#include <vdbshade/vdbshade.h>

/* Expects all that comes behind a job's vsh_bake_job_measure(). */
void cli_bake_expect(const vsh_scene *scene, const vsh_bake_job *job, int32_t threads);

#endif
