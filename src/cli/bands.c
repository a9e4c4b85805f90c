#include "bands.h"

#include "message.h"
#include "planes.h"

#include <stdio.h>

cli_bands_need cli_bands_need_of(const vsh_scene *scene, const vsh_image *image, const char *output,
                                 const vsh_image_options *options) {
    return (cli_bands_need){.channels = image->channel_count,
                            .errors = scene->error != 0,
                            .irradiance = scene->irradiance != 0,
                            .bent = scene->bent != 0,
                            .tint = scene->tint.type != VSH_TINT_NONE && scene->light_count > 0,
                            .interleaved = cli_planes_interleaved(scene),
                            .writer = vsh_image_writer_bytes(output, image, options),
                            .where = output};
}

/* Bytes that the largest of bands of so many rows takes. */
static uint64_t largest(const vsh_charts *charts, const vsh_charts_info *info, const cli_bands_need *need,
                        int32_t rows) {
    uint64_t most = 0;
    for (int32_t first = 0; first < info->height; first += rows) {
        const int32_t left = info->height - first, here = left < rows ? left : rows;
        uint64_t bytes = vsh_charts_band_bytes(charts, first, here, need->channels, need->errors,
                                               need->irradiance, need->bent, need->tint);
        /* as baked, and as the channels that are written */
        bytes += (uint64_t)need->interleaved * sizeof(float) * (uint64_t)info->width * (uint64_t)here;
        most = bytes > most ? bytes : most;
        if (left <= rows) {
            break;
        }
    }
    return need->held + info->bytes + need->writer + most;
}

static int refuse(const vsh_charts_info *info, const cli_bands_need *need, uint64_t bytes) {
    char all[32], held[32], writer[32], limit[32];
    cli_bytes_text(bytes, all, sizeof all);
    cli_bytes_text(need->held + info->bytes, held, sizeof held);
    cli_bytes_text(need->writer, writer, sizeof writer);
    cli_bytes_text(need->limit, limit, sizeof limit);
    const bool gathered = need->writer > need->limit / 4;
    cli_say("%s: %d × %d texels need %s even %d rows at a time (field and charts %s, writing %s), over the "
            "memory limit of %s; %s",
            need->where, info->width, info->height, all, VSH_BAND_STEP, held, writer, limit,
            gathered ? "this format is put together in memory: write .exr, .png or .tif, or raise "
                       "--memory-limit"
                     : "raise --memory-limit, or take larger voxels");
    return CLI_LIMIT;
}

static int32_t up_to_step(int32_t rows) {
    return (rows + VSH_BAND_STEP - 1) / VSH_BAND_STEP * VSH_BAND_STEP;
}

int cli_bands_plan(const vsh_charts *charts, const cli_bands_need *need, cli_bands *bands) {
    vsh_charts_info info;
    vsh_charts_get_info(charts, &info);
    int32_t rows = info.height;
    if (need->rows > 0 && up_to_step(need->rows) < rows) {
        rows = up_to_step(need->rows);
    }
    uint64_t bytes = largest(charts, &info, need, rows);
    if (need->rows == 0 && need->limit > 0 && bytes > need->limit) {
        int32_t low = 1, high = (info.height + VSH_BAND_STEP - 1) / VSH_BAND_STEP; /* steps: fit, do not */
        bytes = largest(charts, &info, need, VSH_BAND_STEP);
        if (bytes > need->limit) {
            return refuse(&info, need, bytes);
        }
        while (high - low > 1) {
            const int32_t middle = low + (high - low) / 2;
            if (largest(charts, &info, need, middle * VSH_BAND_STEP) <= need->limit) {
                low = middle;
            } else {
                high = middle;
            }
        }
        const int32_t most = low * VSH_BAND_STEP, count = (info.height + most - 1) / most;
        rows = up_to_step((info.height + count - 1) / count);
        bytes = largest(charts, &info, need, rows);
        if (bytes > need->limit) { /* evened out, they lie elsewhere */
            rows = most;
            bytes = largest(charts, &info, need, rows);
        }
    }
    *bands = (cli_bands){rows, (info.height + rows - 1) / rows, bytes};
    return CLI_OK;
}
