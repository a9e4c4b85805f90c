/* bake --tile-size: a world tile by tile. */
#include "bake.h"

#include "cli/message.h"
#include "cli/progress.h"
#include "cli/stats.h"
#include "cli/try.h"
#include "cli/warnings.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

/* The tiles of a shard: they follow each other, and each has as many texels as the next. */
typedef struct share {
    size_t first, end;
} share;

static double texels_of(const vsh_scene *scene) {
    double texels = 0.0;
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        texels += (double)scene->receivers[i].width * scene->receivers[i].height;
    }
    return texels;
}

/* Tiles whose middle, by texels, is in the shard's part of them all. */
static int find_share(const cli_bake_settings *s, const vsh_scene *whole, const vsh_tiles *tiles,
                      share *own) {
    const size_t count = vsh_tiles_count(tiles);
    *own = (share){0, count};
    if (s->shard == 0 || s->dry_run) {
        return CLI_OK;
    }
    const double all = texels_of(whole), part = all / s->shard_count;
    double before = 0.0;
    *own = (share){count, count};
    for (size_t i = 0; i < count; ++i) {
        vsh_tile *tile;
        vsh_error error;
        if (vsh_tile_create(tiles, i, &tile, &error) != VSH_OK) {
            return cli_fail_of(NULL, &error);
        }
        const double texels = texels_of(vsh_tile_scene(tile)), middle = before + 0.5 * texels;
        vsh_tile_free(tile);
        before += texels;
        if (middle >= part * (s->shard - 1) && own->first == count) {
            own->first = i;
        }
        if (middle >= part * s->shard && s->shard < s->shard_count) {
            own->end = i;
            break;
        }
    }
    return CLI_OK;
}

static void describe(const vsh_tile *tile, size_t index, size_t count, char *text, size_t size) {
    vsh_tile_info info;
    vsh_tile_get_info(tile, &info);
    snprintf(text, size, "tile %zu of %zu: %zu receiver%s; %zu of %zu objects cast, %" PRIu64 " triangles",
             index + 1, count, info.receivers, info.receivers == 1 ? "" : "s", info.objects, info.all_objects,
             info.triangles);
}

static int bake_tile(const cli_bake_settings *s, const vsh_tiles *tiles, size_t index, cli_bake_sum *sum) {
    vsh_tile *tile;
    vsh_error error;
    if (vsh_tile_create(tiles, index, &tile, &error) != VSH_OK) {
        return cli_fail_of(NULL, &error);
    }
    if (s->common.verbose) {
        char text[256];
        describe(tile, index, vsh_tiles_count(tiles), text, sizeof text);
        cli_say("%s", text);
    }
    const int code = cli_bake_one(s, vsh_tile_scene(tile), sum);
    vsh_tile_free(tile);
    return code;
}

static int bake_share(const cli_bake_settings *s, const vsh_scene *whole, const vsh_tiles *tiles, share own) {
    const vsh_run run = cli_common_run(&s->common);
    cli_bake_sum sum = {.errors = calloc(whole->light_count + 2, sizeof *sum.errors)};
    int code = sum.errors != NULL ? CLI_OK : cli_out_of_memory("statistics");
    for (size_t i = own.first; i < own.end && code == CLI_OK; ++i) {
        cli_progress_round("tile", i - own.first, own.end - own.first);
        code = bake_tile(s, tiles, i, &sum);
    }
    if (code != CLI_OK) {
        goto done;
    }
    cli_stats stats = cli_bake_stats(whole, &sum.report, run.threads);
    stats.world_tiles = sum.bakes;
    CLI_TRY_DONE(cli_stats_finish(&stats, &run, s->stats));
    cli_warnings_tell();
    if (!s->common.quiet) {
        cli_say("%zu of %zu tiles: %" PRIu64 " texels, %" PRIu64 " of them invalid; --verbose tells of each",
                own.end - own.first, vsh_tiles_count(tiles), stats.texels, stats.invalid_texels);
    }
    if (!s->common.quiet && own.first < own.end) {
        cli_stats_say(&stats);
    }
done:
    free(sum.errors);
    return code;
}

/* Of each tile what casts in it, and what the largest of them will take. */
static int forecast(const cli_bake_settings *s, const vsh_tiles *tiles) {
    const size_t count = vsh_tiles_count(tiles);
    vsh_tile *largest = NULL;
    vsh_tile_info most = {.receivers = 0};
    int code = CLI_OK;
    for (size_t i = 0; i < count; ++i) {
        vsh_tile *tile;
        vsh_tile_info info;
        vsh_error error;
        char text[256];
        if (vsh_tile_create(tiles, i, &tile, &error) != VSH_OK) {
            code = cli_fail_of(NULL, &error);
            goto done;
        }
        describe(tile, i, count, text, sizeof text);
        printf("%s\n", text);
        vsh_tile_get_info(tile, &info);
        const bool larger = largest == NULL || info.triangles > most.triangles;
        vsh_tile_free(larger ? largest : tile);
        largest = larger ? tile : largest;
        most = larger ? info : most;
    }
    printf("the tile of the most triangles:\n");
    fflush(stdout);
    code = cli_bake_one(s, vsh_tile_scene(largest), NULL);
done:
    vsh_tile_free(largest);
    return code;
}

int cli_bake_tiles(const cli_bake_settings *s, const vsh_scene *scene) {
    const vsh_run run = cli_common_run(&s->common);
    vsh_tiles *tiles;
    vsh_error error;
    share own;
    if (vsh_tiles_create(scene, s->tile_size, &run, &tiles, &error) != VSH_OK) {
        return cli_fail_of(NULL, &error);
    }
    int code = find_share(s, scene, tiles, &own);
    if (code == CLI_OK) {
        code = s->dry_run ? forecast(s, tiles) : bake_share(s, scene, tiles, own);
    }
    vsh_tiles_free(tiles);
    return code;
}
