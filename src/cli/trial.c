#include "trial.h"

#include "message.h"
#include "signals.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

/* Address space beyond the memory limit: libraries, stacks of the thread pool, arenas of the allocator. */
static const uint64_t address_space_slack = (uint64_t)2 << 30;

/* A sanitizer's shadow memory takes terabytes of address space. */
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define CLI_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define CLI_SANITIZED 1
#endif
#endif
#ifndef CLI_SANITIZED
#define CLI_SANITIZED 0
#endif

static void limit_child(uint64_t memory) {
    const struct rlimit no_core = {0, 0};
    setrlimit(RLIMIT_CORE, &no_core);
    if (memory > 0 && !CLI_SANITIZED) {
        const rlim_t bytes = (rlim_t)(memory + address_space_slack);
        const struct rlimit space = {bytes, bytes};
        setrlimit(RLIMIT_AS, &space);
    }
}

int cli_isolated(const char *path, uint64_t memory, int (*work)(void *user), void *user) {
    fflush(NULL);
    const pid_t parent = getpid();
    const pid_t child = fork();
    if (child < 0) {
        cli_say("%s: no process to read it in: %s", path, strerror(errno));
        return CLI_LIMIT;
    }
    if (child == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (getppid() != parent) {
            _exit(CLI_INTERRUPTED);
        }
        limit_child(memory);
        const int code = work(user);
        const int flushed = fflush(NULL);
        _exit(flushed == 0 ? code : CLI_FILE);
    }
    int status = 0;
    for (;;) {
        const pid_t ended = waitpid(child, &status, WNOHANG);
        if (ended == child) {
            break;
        }
        if (cli_interrupted()) {
            kill(child, SIGKILL);
            waitpid(child, &status, 0);
            const vsh_error cancelled = {VSH_ERROR_CANCELLED, ""};
            return cli_fail(&cancelled);
        }
        const struct timespec pause = {0, 2000000};
        nanosleep(&pause, NULL);
    }
    if (WIFEXITED(status)) {
        return WEXITSTATUS(status);
    }
    cli_say("%s: damaged: the reader crashed", path);
    return CLI_FILE;
}

typedef struct trial {
    const char *path;
    const char *name;
    uint64_t memory;
} trial;

static int read_grid(void *user) {
    const trial *t = user;
    vsh_grid *grid = NULL;
    vsh_error error;
    const vsh_run run = vsh_run_default();
    const vsh_result result = vsh_grid_read(t->path, t->name, &run, &grid, &error);
    return result == VSH_OK ? CLI_OK : cli_fail(&error);
}

static int trial_read(const char *path, const char *name, uint64_t memory) {
    trial t = {path, name, memory};
    return cli_isolated(path, memory, read_grid, &t);
}

/* An outline's file and how it is read; text NULL: an image. */
typedef struct outline_trial {
    const char *path, *text;
    const vsh_mask_options *mask;
    const vsh_text_options *letters;
} outline_trial;

static int read_outline(void *user) {
    const outline_trial *t = user;
    vsh_outline *outline = NULL;
    vsh_error error;
    const vsh_run run = vsh_run_default();
    const vsh_result result =
        t->text == NULL ? vsh_outline_from_image(t->path, t->mask, &run, &outline, &error)
                        : vsh_outline_from_text(t->text, t->path, t->letters, &run, &outline, &error);
    return result == VSH_OK ? CLI_OK : cli_fail(&error);
}

static int trial_outline(outline_trial t, uint64_t memory) {
    return cli_isolated(t.path, memory, read_outline, &t);
}

int cli_trial_flat(const vsh_flat_scene *scene, uint64_t memory) {
    int code = CLI_OK;
    for (size_t i = 0; i < scene->caster_count && code == CLI_OK; ++i) {
        const vsh_flat_caster *caster = &scene->casters[i];
        if (caster->type == VSH_FLAT_MASK || caster->type == VSH_FLAT_TEXT) {
            code = trial_outline((outline_trial){caster->path, caster->text, &caster->mask, &caster->letters},
                                 memory);
        }
    }
    return code;
}

int cli_trial_casters(const vsh_scene *scene, uint64_t memory) {
    int code = CLI_OK;
    for (size_t i = 0; i < scene->caster_count && code == CLI_OK; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        if (caster->type == VSH_CASTER_VDB) {
            code = trial_read(caster->path, caster->grid, memory);
        } else if (caster->type == VSH_CASTER_MASK || caster->type == VSH_CASTER_TEXT) {
            code = trial_outline((outline_trial){caster->path, caster->text, &caster->mask, &caster->letters},
                                 memory);
        }
    }
    return code;
}

static int read_voxels(void *user) {
    const trial *t = user;
    vsh_voxels *voxels = NULL;
    vsh_error error;
    vsh_run run = vsh_run_default();
    run.memory_limit = t->memory;
    const vsh_result result = vsh_voxels_from_vdb(t->path, t->name, &run, &voxels, &error);
    return result == VSH_OK ? CLI_OK : cli_fail(&error);
}

int cli_trial_voxels(const char *path, const char *name, uint64_t memory) {
    trial t = {path, name, memory};
    return cli_isolated(path, memory, read_voxels, &t);
}
