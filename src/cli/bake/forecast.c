#include "bake.h"

#include "base/bytes.h"
#include "cli/message.h"
#include "cli/stats.h"

#include <inttypes.h>
#include <stdio.h>

static void print_methods(const vsh_scene *scene, int32_t has_triangles) {
    cli_stats stats = {.of = CLI_STATS_TEXELS};
    char text[128];
    cli_stats_methods(&stats, scene, has_triangles);
    printf("methods       %s\n", cli_stats_methods_text(&stats, text, sizeof text));
}

int cli_bake_forecast(const vsh_scene *scene, vsh_bake_job *job, const vsh_run *run) {
    vsh_bake_forecast f;
    vsh_error error;
    if (vsh_bake_job_forecast(job, run, &f, &error) != VSH_OK) {
        return cli_fail_of(NULL, &error);
    }
    const size_t count = vsh_bake_job_count(job);
    char grid[32], field[32], peak[32];
    print_methods(scene, f.has_triangles);
    printf("texels        %" PRIu64 " in %zu lightmap%s, %" PRIu64 " samples\n", f.texels, count,
           count == 1 ? "" : "s", f.samples);
    if (f.voxels == 0.0) {
        printf("voxels        none\n");
    } else {
        printf("voxels        about %.3g of %.4g, %.4g along the longest side\n", f.voxels, f.voxel_size,
               f.resolution);
    }
    printf("memory        about %s at most: level set %s, field %s\n",
           vshi_bytes_text((uint64_t)f.peak_bytes, peak, sizeof peak),
           vshi_bytes_text((uint64_t)f.grid_bytes, grid, sizeof grid),
           vshi_bytes_text((uint64_t)f.field_bytes, field, sizeof field));
    return CLI_OK;
}
