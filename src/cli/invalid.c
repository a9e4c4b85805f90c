#include "invalid.h"

#include "message.h"
#include "paths.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Of no chart, valid, invalid, and invalid in plain sight. */
static const float COLOURS[4][3] = {
    {0.05f, 0.05f, 0.06f}, {0.5f, 0.5f, 0.5f}, {0.7f, 0.05f, 0.05f}, {1.0f, 0.85f, 0.1f}};
static const char *const NAMES[3] = {"R", "G", "B"};

int cli_invalid_check(const char *path) {
    if (!cli_has_ending(path, "png")) {
        return cli_usage("--invalid '%s': expected a name that ends in .png", path);
    }
    return CLI_OK;
}

/* "where.png" for "out/floor.exr", one of several: "where.floor.png". */
static char *name_for(const char *path, const char *output, bool several) {
    const char *slash = strrchr(output, '/');
    const char *name = slash != NULL ? slash + 1 : output, *dot = strrchr(name, '.');
    const int length = dot != NULL ? (int)(dot - name) : (int)strlen(name);
    const int stem = (int)(strlen(path) - strlen(".png"));
    const size_t size = strlen(path) + (size_t)length + 2;
    char *made = malloc(size);
    if (made != NULL && several) {
        snprintf(made, size, "%.*s.%.*s.png", stem, path, length, name);
    } else if (made != NULL) {
        snprintf(made, size, "%s", path);
    }
    return made;
}

int cli_invalid_open(cli_invalid *picture, const char *path, const char *output, bool several, int32_t width,
                     int32_t height, int32_t rows) {
    memset(picture, 0, sizeof *picture);
    if (path == NULL) {
        return CLI_OK;
    }
    picture->path = name_for(path, output, several);
    for (int c = 0; c < 3; ++c) {
        picture->planes[c] = calloc((size_t)width * (size_t)rows, sizeof(float));
        if (picture->planes[c] == NULL || picture->path == NULL) {
            return cli_out_of_memory(path);
        }
    }
    picture->image =
        (vsh_image){width, height, 3, (const char *const *)NAMES, (const float *const *)picture->planes};
    vsh_image_options options = vsh_image_options_default();
    options.bits = 8;
    vsh_error error;
    return vsh_image_writer_create(picture->path, &picture->image, &options, &picture->writer, &error) ==
                   VSH_OK
               ? CLI_OK
               : cli_fail(&error);
}

int cli_invalid_add(cli_invalid *picture, int32_t rows, const float *invalid, const float *coverage) {
    if (picture->writer == NULL) {
        return CLI_OK;
    }
    const size_t texels = (size_t)picture->image.width * (size_t)rows;
    for (size_t i = 0; i < texels; ++i) {
        const int kind = invalid[i] > 1.0f ? 3 : invalid[i] > 0.0f ? 2 : coverage[i] > 0.0f ? 1 : 0;
        for (int c = 0; c < 3; ++c) {
            picture->planes[c][i] = COLOURS[kind][c];
        }
    }
    vsh_error error;
    return vsh_image_writer_add(picture->writer, rows, picture->image.planes, &error) == VSH_OK
               ? CLI_OK
               : cli_fail(&error);
}

int cli_invalid_close(cli_invalid *picture, int code) {
    vsh_error error;
    if (picture->writer != NULL && code != CLI_OK) {
        vsh_image_writer_abandon(picture->writer);
    } else if (picture->writer != NULL && vsh_image_writer_finish(picture->writer, &error) != VSH_OK) {
        code = cli_fail(&error);
    }
    for (int c = 0; c < 3; ++c) {
        free(picture->planes[c]);
    }
    free(picture->path);
    memset(picture, 0, sizeof *picture);
    return code;
}

enum { WORST = 3 }; /* meshes that are named */

/* " 'floor' 1200, 'walls' 300 and 4 others", those with the most texels first. */
static void name_worst(const vsh_mesh *meshes, size_t mesh_count, const uint64_t *invalid, char *text,
                       size_t size) {
    size_t worst[WORST], named = 0, others = 0, at = 0;
    for (size_t m = 0; m < mesh_count; ++m) {
        others += invalid[m] > 0;
        size_t place = named;
        for (; place > 0 && invalid[worst[place - 1]] < invalid[m]; --place) {
            if (place < WORST) {
                worst[place] = worst[place - 1];
            }
        }
        if (invalid[m] > 0 && place < WORST) {
            worst[place] = m;
            named += named < WORST;
        }
    }
    text[0] = '\0';
    for (size_t k = 0; k < named && at < size; ++k) {
        const char *name = meshes[worst[k]].name;
        at += (size_t)snprintf(text + at, size - at, "%s'%s' %" PRIu64, k > 0 ? ", " : "",
                               name != NULL ? name : "", invalid[worst[k]]);
    }
    if (others > named && at < size) {
        snprintf(text + at, size - at, " and %zu more", others - named);
    }
}

void cli_invalid_warn(const vsh_run *run, const char *path, const vsh_mesh *meshes, size_t mesh_count,
                      const vsh_bake_stats *baked, bool traced) {
    char names[512], seen[384], line[1536];
    if (baked->invalid_texels == 0) {
        return;
    }
    name_worst(meshes, mesh_count, baked->invalid_by_mesh, names, sizeof names);
    if (!traced) {
        snprintf(
            seen, sizeof seen,
            "as far as voxels tell; smaller ones, or --method exact and --ao-method exact, leave only those "
            "that are; --invalid FILE.png shows them");
    } else if (baked->seen_texels > 0) {
        snprintf(seen, sizeof seen,
                 "%" PRIu64 " of them in plain sight, through holes; --invalid FILE.png shows where; what is "
                 "taken for solid, 'vdbshade info' tells",
                 baked->seen_texels);
    } else {
        snprintf(seen, sizeof seen, "none in plain sight; --invalid FILE.png shows where");
    }
    snprintf(line, sizeof line,
             "%s: %" PRIu64 " of %" PRIu64 " texels are invalid (inside a solid or behind a wall): %s; %s",
             path, baked->invalid_texels, baked->texels, names, seen);
    run->warning(run->user, line);
}
