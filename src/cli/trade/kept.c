/* --field: fields of some of the voxel sizes, out of files. */
#include "cli/message.h"
#include "cli/try.h"
#include "trade.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Voxels along the longest side that a file's field was told of; 0: of their size, or of none. */
static int32_t resolution_of(const vsh_field_file *file) {
    vsh_kept_field kept;
    vsh_field_file_get(file, 0, &kept);
    for (size_t i = 0; i < kept.origin_count; ++i) {
        if (strcmp(kept.origin[i].name, "resolution") == 0) {
            char *end;
            const long number = strtol(kept.origin[i].value, &end, 10);
            return end != kept.origin[i].value && *end == '\0' && number >= TRADE_LEAST_RESOLUTION &&
                           number <= TRADE_MOST_RESOLUTION
                       ? (int32_t)number
                       : 0;
        }
    }
    return 0;
}

static int check(const trade_settings *s, const trade_kept *kept, size_t index) {
    const char *path = s->kept[index];
    const int32_t resolution = kept[index].resolution;
    if (resolution == 0) {
        return cli_usage("--field '%s': is of no --resolution, by which trade measures: make it by one",
                         path);
    }
    for (size_t i = 0; i < index; ++i) {
        if (kept[i].resolution == resolution) {
            return cli_usage("--field '%s': of %d voxels there is %s already", path, resolution, s->kept[i]);
        }
    }
    bool meant = s->resolution_count == 0;
    for (size_t i = 0; i < s->resolution_count && !meant; ++i) {
        meant = s->resolutions[i] == resolution;
    }
    return meant ? CLI_OK
                 : cli_usage("--field '%s': is of %d voxels, which --resolutions has not", path, resolution);
}

static int larger_first(const void *a, const void *b) {
    const int32_t x = *(const int32_t *)a, y = *(const int32_t *)b;
    return (x < y) - (x > y);
}

/* The files' in place of --resolutions, which stands in outputs as if it had been given: a part and its merge
 * are of the same. */
static void take_resolutions(trade_settings *s, const trade_kept *kept) {
    char text[TRADE_MAX_RESOLUTIONS * 8] = "";
    size_t used = 0;
    for (size_t i = 0; i < s->kept_count; ++i) {
        s->resolutions[s->resolution_count++] = kept[i].resolution;
    }
    qsort(s->resolutions, s->resolution_count, sizeof s->resolutions[0], larger_first);
    for (size_t i = s->resolution_count; i-- > 0;) {
        used +=
            (size_t)snprintf(text + used, sizeof text - used, "%d%s", s->resolutions[i], i > 0 ? "," : "");
    }
    cli_parsed_add("resolutions", text);
}

int trade_open_kept(trade_settings *s, trade_kept kept[TRADE_MAX_RESOLUTIONS]) {
    static const int32_t otherwise[] = {256, 128, 64};
    const vsh_run run = cli_common_run(&s->bake.common);
    for (size_t i = 0; i < s->kept_count; ++i) {
        vsh_error error;
        if (vsh_field_file_open(s->kept[i], &run, &kept[i].file, &error) != VSH_OK) {
            return cli_fail(&error);
        }
        kept[i].resolution = resolution_of(kept[i].file);
        CLI_TRY(check(s, kept, i));
    }
    if (s->resolution_count == 0 && s->kept_count > 0) {
        take_resolutions(s, kept);
    } else if (s->resolution_count == 0) {
        memcpy(s->resolutions, otherwise, sizeof otherwise);
        s->resolution_count = sizeof otherwise / sizeof otherwise[0];
    }
    qsort(s->resolutions, s->resolution_count, sizeof s->resolutions[0], larger_first);
    return CLI_OK;
}

void trade_close_kept(const trade_settings *s, trade_kept kept[TRADE_MAX_RESOLUTIONS]) {
    for (size_t i = 0; i < s->kept_count; ++i) {
        vsh_field_file_close(kept[i].file);
    }
}
