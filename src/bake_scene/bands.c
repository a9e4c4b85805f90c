#include "bake_scene/bands.h"

#include "bake/part.h"
#include "bake/texels.h"
#include "bake_scene/merge.h"
#include "base/bytes.h"
#include "base/try.h"

#include <math.h>

/* What a lightmap takes, whatever is baked at a time. */
typedef struct cost {
    const vsh_charts *charts;
    vsh_charts_info info;
    vsh_lightmap lightmap; /* which planes are baked */
    size_t light_count;
    int32_t floats; /* beside those a texel: pictures, and what is baked interleaved and then split */
    uint64_t held, writer, limit;
    bool in_memory;     /* the writer needs the whole file in memory */
    int32_t first, end; /* rows that are baked */
    int32_t channels;
    const vshi_ao_cut *cut; /* of a part; NULL: of none */
    int32_t threads;
    bool merge;
} cost;

/* Bytes of rows that are taken from parts: theirs, and those around them that they are filled from. */
static uint64_t merging(const cost *c, int32_t first, int32_t rows) {
    const int32_t height = c->info.height, reach = vshi_part_reach(c->charts);
    const int32_t above = first < reach ? first : reach;
    const int32_t left = height - first - rows, below = left < reach ? left : reach;
    const bool whole = rows == height;
    const double texels = (double)c->info.width * (double)rows;
    const double held = (double)c->info.width * (double)(above + rows + below);
    bool fills;
    vshi_part_padding(c->charts, &fills);
    return (uint64_t)(texels * sizeof(float) * c->channels +
                      held * (sizeof(uint32_t) + (whole ? 0.0 : sizeof(float) * (double)c->channels)) +
                      fmax(vshi_rows_complete_bytes(c->info.width, above + rows + below, fills && whole),
                           vshi_parts_finish_bytes(c->info.width, above + rows + below, c->charts->ao_spacing,
                                                   c->threads, vshi_part_kinds(&c->lightmap))));
}

/* Bytes of what is kept of a part's rows. */
static uint64_t keeping(const cost *c, int32_t first, int32_t rows) {
    const int32_t kept = vshi_ao_cut_kept(c->cut, first + rows) - vshi_ao_cut_kept(c->cut, first);
    return (uint64_t)kept * (uint64_t)c->info.width * vshi_ao_kept_bytes(c->cut->kinds);
}

/* Bytes that the largest of bands of so many rows takes. */
static uint64_t largest(const cost *c, int32_t rows) {
    uint64_t most = 0;
    for (int32_t first = c->first; first < c->end; first += rows) {
        const int32_t left = c->end - first, here = left < rows ? left : rows;
        uint64_t bytes =
            c->merge ? merging(c, first, here)
                     : vshi_charts_band_bytes(c->charts, first, here, c->cut, &c->lightmap, c->light_count);
        bytes += c->cut != NULL ? keeping(c, first, here) : 0;
        bytes += (uint64_t)c->floats * sizeof(float) * (uint64_t)c->info.width * (uint64_t)here;
        most = bytes > most ? bytes : most;
        if (left <= rows) {
            break;
        }
    }
    return c->held + c->info.bytes + c->writer + most;
}

/* Names the remedy for the largest share of the bytes. */
static const char *advice(const cost *c, uint64_t rows, uint64_t held) {
    if (c->writer > rows && c->writer > held) {
        return c->in_memory ? "this format is put together in memory: write .exr, .png or .tif, or raise "
                              "--memory-limit"
                            : "raise --memory-limit, or take a smaller --size or fewer channels";
    }
    return rows > held ? "raise --memory-limit, or take a smaller --size or fewer channels"
                       : "raise --memory-limit, or take larger voxels";
}

static vsh_result refuse(const cost *c, const char *output, uint64_t bytes, vsh_error *error) {
    char all[VSHI_BYTES_ROOM], band[VSHI_BYTES_ROOM], held[VSHI_BYTES_ROOM], writer[VSHI_BYTES_ROOM],
        limit[VSHI_BYTES_ROOM];
    const uint64_t held_bytes = c->held + c->info.bytes, row_bytes = bytes - held_bytes - c->writer;
    return vshi_fail(error, VSH_ERROR_LIMIT,
                     "%s: %d × %d texels need %s even %d rows at a time (rows %s, field and charts %s, "
                     "writing %s), over the memory limit of %s; %s",
                     output, c->info.width, c->info.height, vshi_bytes_text(bytes, all, sizeof all),
                     VSH_BAND_STEP, vshi_bytes_text(row_bytes, band, sizeof band),
                     vshi_bytes_text(held_bytes, held, sizeof held),
                     vshi_bytes_text(c->writer, writer, sizeof writer),
                     vshi_bytes_text(c->limit, limit, sizeof limit), advice(c, row_bytes, held_bytes));
}

static int32_t up_to_step(int32_t rows) {
    return (rows + VSH_BAND_STEP - 1) / VSH_BAND_STEP * VSH_BAND_STEP;
}

/* The most rows within the limit, where a step of them is within it and all are not. */
static int32_t most_rows(const cost *c) {
    const int32_t height = c->end - c->first;
    int32_t low = 1, high = (height + VSH_BAND_STEP - 1) / VSH_BAND_STEP; /* steps: fit, do not */
    while (high - low > 1) {
        const int32_t middle = low + (high - low) / 2;
        if (largest(c, middle * VSH_BAND_STEP) <= c->limit) {
            low = middle;
        } else {
            high = middle;
        }
    }
    const int32_t most = low * VSH_BAND_STEP, count = (height + most - 1) / most;
    const int32_t even = up_to_step((height + count - 1) / count);
    return largest(c, even) <= c->limit ? even : most; /* evened out, they lie elsewhere */
}

/* `wanted` rows, or (0) as many as go. */
static vsh_result plan(const cost *c, int32_t wanted, const char *output, vshi_bands *bands,
                       vsh_error *error) {
    const int32_t height = c->end - c->first;
    int32_t rows = wanted > 0 && up_to_step(wanted) < height ? up_to_step(wanted) : height;
    if (wanted == 0 && c->limit > 0 && largest(c, rows) > c->limit) {
        const uint64_t least = largest(c, VSH_BAND_STEP);
        if (least > c->limit) {
            return refuse(c, output, least, error);
        }
        rows = most_rows(c);
    }
    *bands = (vshi_bands){rows, (height + rows - 1) / rows, largest(c, rows), c->first, c->end};
    return VSH_OK;
}

vsh_result vshi_bands_plan(const vsh_scene *scene, const vshi_target *target, const vsh_charts *charts,
                           const vshi_bands_need *need, vshi_bands *bands, vsh_error *error) {
    const vsh_receiver *receiver = &target->receiver;
    const vsh_image_options image = vshi_receiver_image(receiver);
    vshi_channels channels;
    vsh_result result;
    VSHI_TRY_DONE(vshi_channels_name(scene, receiver->width, receiver->height, &channels, error));
    cost c = {.charts = charts,
              .lightmap = vshi_channels_shape(scene),
              .light_count = scene->light_count,
              .floats = 3 * (int32_t)channels.triple_count + (need->picture ? 4 : 0) +
                        (scene->planes.invalid ? 1 : 0) + (need->cut != NULL ? 1 : 0),
              .channels = channels.image.channel_count,
              .first = need->first,
              .end = need->end,
              .cut = need->cut,
              .threads = need->threads,
              .merge = need->merge,
              .held = need->held,
              .limit = need->limit};
    c.writer = need->files ? vsh_image_writer_bytes(receiver->output, &channels.image, &image) : 0;
    vsh_image half = channels.image;
    half.height = (half.height + 1) / 2;
    c.in_memory = need->files && vsh_image_writer_bytes(receiver->output, &half, &image) < c.writer;
    vsh_charts_get_info(charts, &c.info);
    VSHI_TRY_DONE(plan(&c, need->rows, receiver->output, bands, error));
done:
    vshi_channels_free(&channels);
    return result;
}
