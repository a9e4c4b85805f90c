/* Our own look at mesh files, before Assimp sees them: every scanner on any bytes. */
#include "fuzz.h"

#include "model/scan.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static const char *const endings[] = {"stl", "dae"};
    if (size == 0) {
        return 0; /* files that are empty never get here */
    }
    const vsh_run run = fuzz_run();
    for (size_t i = 0; i < sizeof endings / sizeof endings[0]; ++i) {
        vshi_job *job = vshi_job_begin(&run, "load", 100);
        if (job == NULL) {
            return 0;
        }
        char path[16] = "a.";
        strcat(path, endings[i]);
        vshi_scan scan = {.path = path, .text = (const char *)data, .size = size, .job = job, .units = 100};
        vsh_error error;
        const vsh_result result = vshi_scan_file(&scan, endings[i], fuzz_error(&error));
        fuzz_ended(result, &error, result == VSH_OK ? &scan : NULL);
        vshi_job_end(job);
    }
    return 0;
}
