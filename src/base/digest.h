/* Hashing a file that may be large. */
#ifndef VSHI_DIGEST_H
#define VSHI_DIGEST_H

#include "base/job.h"

#include <vdbshade/digest.h>

/* vsh_file_digest(), within a job that is under way. */
vsh_result vshi_file_digest(const char *path, char digest[VSH_DIGEST_TEXT], vshi_job *job, vsh_error *error);

#endif
