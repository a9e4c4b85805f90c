/* Charts that lie closer to each other than a texel. */
#ifndef CLI_CLOSENESS_H
#define CLI_CLOSENESS_H

#include "receiver.h"

/* Warns of charts that are too close for the size; where some lie over others, as `reports` say, that has
 * been told. */
void cli_closeness_warn(const cli_receiver_job *job, const vsh_uv_report *reports);

#endif
