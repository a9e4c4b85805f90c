/* What the stages of a bake are expected to take, for its progress. */
#ifndef CLI_BAKE_EXPECT_H
#define CLI_BAKE_EXPECT_H

#include <stdbool.h>
#include <vdbshade/vdbshade.h>

/* A receiver, counted. */
typedef struct cli_expected_receiver {
    uint64_t texels, samples;
    bool banded; /* several bands: told as one stage, "bake" */
} cli_expected_receiver;

/* Expects all that comes behind the counting of the receivers [scene->receiver_count]. */
void cli_bake_expect(const vsh_scene *scene, const vsh_assets *assets, const cli_expected_receiver *receivers,
                     int32_t threads);

#endif
