/* Both files are looked at in a child process first: their readers can crash on damaged ones. */
#include "comparison.h"
#include "message.h"
#include "paths.h"
#include "trial.h"

#include <stdlib.h>

typedef struct look {
    const char *path;
    uint64_t memory;
} look;

static int look_at(void *user) {
    const look *l = user;
    vsh_error error;
    vsh_result result;
    if (cli_has_ending(l->path, "vdb")) {
        vsh_run run = vsh_run_default();
        run.memory_limit = l->memory;
        size_t count;
        result = vsh_vdb_list(l->path, &run, NULL, 0, &count, &error);
        vsh_vdb_entry *entries = result == VSH_OK ? calloc(count + 1, sizeof *entries) : NULL;
        if (entries != NULL) { /* read, not only counted */
            result = vsh_vdb_list(l->path, &run, entries, count, &count, &error);
        }
        free(entries);
    } else {
        vsh_image_file *file = NULL;
        result = vsh_image_read(l->path, &file, &error);
    }
    return result == VSH_OK ? CLI_OK : cli_fail(&error);
}

/* EXR files and PNGs are read by libraries that take damage well. */
static int look_in_child(const char *path, uint64_t memory) {
    if (cli_has_ending(path, "exr") || cli_has_ending(path, "png")) {
        return CLI_OK;
    }
    look l = {path, memory};
    return cli_isolated(path, memory, look_at, &l);
}

int cli_comparison_trial(const char *golden, const char *fresh, uint64_t memory) {
    const int code = look_in_child(golden, memory);
    return code == CLI_OK ? look_in_child(fresh, memory) : code;
}
