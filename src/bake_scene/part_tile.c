#include "bake_scene/part_tile.h"

#include "bake/planes.h"
#include "base/part_file.h"
#include "base/try.h"
#include "shade/ao.h"

#include <math.h>
#include <string.h>

/* Whether a plane is set when the page is finished, not by its tiles. */
static bool is_finished_later(const vshi_job_page *page, const float *plane) {
    const vsh_lightmap *planes = &page->channels.lightmap;
    return plane == planes->coverage || plane == planes->invalid ||
           (page->page.ao.share != NULL &&
            (plane == planes->ao || plane == planes->ao_error || plane == planes->bent)) ||
           (page->page.sky.share != NULL && plane == planes->sky);
}

static size_t add_shots(const vshi_shots *shots, vshi_part_array *arrays) {
    if (shots->share == NULL) {
        return 0;
    }
    arrays[0] = (vshi_part_array){(unsigned char *)shots->share, sizeof *shots->share, NULL};
    arrays[1] = (vshi_part_array){(unsigned char *)shots->rays, sizeof *shots->rays, NULL};
    arrays[2] = (vshi_part_array){shots->level, sizeof *shots->level, NULL};
    arrays[3] = (vshi_part_array){(unsigned char *)shots->open, 3 * sizeof *shots->open, NULL};
    return shots->open != NULL ? 4 : 3;
}

size_t vshi_part_list(const vshi_job_page *page, vshi_part_array arrays[VSHI_PART_ARRAYS]) {
    const vshi_channels *channels = &page->channels;
    size_t count = 0, channel = 0;
    arrays[count++] = (vshi_part_array){page->page.state, 1, NULL};
    for (size_t i = 0; i < channels->value_count; ++i) {
        if (!is_finished_later(page, channels->values[i])) {
            arrays[count++] =
                (vshi_part_array){(unsigned char *)channels->values[i],
                                  channels->components[i] * sizeof(float), channels->names[channel]};
        }
        channel += channels->components[i];
    }
    count += add_shots(&page->page.ao, arrays + count);
    return count + add_shots(&page->page.sky, arrays + count);
}

/* Texels of a tile: columns and rows from the first on. */
typedef struct place {
    size_t left, top, columns, rows;
} place;

static place place_of(const vshi_job_page *page, size_t tile) {
    const vshi_page *p = &page->page;
    const size_t across = (p->width + VSHI_TILE - 1) / VSHI_TILE;
    place at = {tile % across * VSHI_TILE, tile / across * VSHI_TILE, VSHI_TILE, VSHI_TILE};
    at.columns = p->width - at.left < VSHI_TILE ? p->width - at.left : VSHI_TILE;
    at.rows = p->height - at.top < VSHI_TILE ? p->height - at.top : VSHI_TILE;
    return at;
}

size_t vshi_part_copy(const vshi_job_page *page, const vshi_part_array *array, size_t tile,
                      unsigned char *bytes, bool in) {
    const place at = place_of(page, tile);
    const size_t size = at.columns * array->size;
    size_t next = 0;
    for (size_t y = 0; y < at.rows; ++y, next += size) {
        unsigned char *row = array->values + ((at.top + y) * page->page.width + at.left) * array->size;
        memcpy(in ? row : bytes + next, in ? bytes + next : row, size);
    }
    while (next % 4 != 0) {
        bytes[next] = in ? bytes[next] : 0;
        ++next;
    }
    return next;
}

static vsh_result check_values(const vshi_job_page *page, const vshi_part_array *array, size_t texel,
                               const char *path, vsh_error *error) {
    float low, high;
    const bool may_be_nan = vshi_channel_range(array->channel, &low, &high);
    const size_t count = array->size / sizeof(float);
    for (size_t k = 0; k < count; ++k) {
        const float value = ((const float *)(const void *)array->values)[count * texel + k];
        if (!(value >= low && value <= high) && !(may_be_nan && isnan(value))) {
            return vshi_fail(error, VSH_ERROR_INPUT,
                             "%s: damaged: '%s' of texel (%zu, %zu) of lightmap %zu is %g, out of range %g … "
                             "%g; bake this part again",
                             path, array->channel, texel % page->page.width, texel / page->page.width,
                             page->index, (double)value, (double)low, (double)high);
        }
    }
    return VSH_OK;
}

/* Whether a texel's shots can be a bake's. */
static bool is_sound(const vshi_job_page *page, const vshi_shots *shots, size_t texel) {
    enum { MOST_RAYS = 1 << 24 };
    static const float LONGEST = 3.0f; /* mean of open directions: what they lean by is taken out */
    if (shots->share == NULL) {
        return true;
    }
    const uint32_t level = shots->level[texel], spacing = (uint32_t)page->charts->ao_spacing;
    const float share = shots->share[texel];
    bool sound = level == 0 || page->page.state[texel] != VSHI_TEXEL_EMPTY;
    sound = sound &&
            (level == 0 || level == VSHI_AO_KNOWN_LEVEL || (level <= spacing && (level & (level - 1)) == 0));
    sound = sound && shots->rays[texel] >= 0 && shots->rays[texel] <= MOST_RAYS;
    sound = sound && ((share >= 0.0f && share <= 1.0f) || (isnan(share) && shots->rays[texel] == 0));
    for (size_t k = 0; k < 3 && shots->open != NULL; ++k) {
        const float open = shots->open[3 * texel + k];
        sound = sound && (fabsf(open) <= LONGEST || (isnan(open) && shots->rays[texel] == 0));
    }
    return sound;
}

static bool is_held_sound(const vshi_job_page *page, const vshi_held_texel *held, size_t tile) {
    const place at = place_of(page, tile);
    const int32_t rays = vshi_field_error_rays(page->page.shade.max_error);
    const size_t x = vsh_texel_column(held->texel), y = vsh_texel_row(held->texel);
    return x >= at.left && x < at.left + at.columns && y >= at.top && y < at.top + at.rows &&
           held->free[0] <= rays && held->free[1] <= rays && held->even >= -1 && held->even <= 1;
}

vsh_result vshi_part_check_tile(const vshi_job_page *page, size_t tile, const char *path, vsh_error *error) {
    const place at = place_of(page, tile);
    vshi_part_array arrays[VSHI_PART_ARRAYS];
    const size_t count = vshi_part_list(page, arrays);
    const vshi_page *p = &page->page;
    bool sound = true;
    for (size_t k = 0; k < at.columns * at.rows; ++k) {
        const size_t texel = (at.top + k / at.columns) * p->width + at.left + k % at.columns;
        for (size_t i = 0; i < count; ++i) {
            VSHI_TRY(arrays[i].channel != NULL ? check_values(page, &arrays[i], texel, path, error) : VSH_OK);
        }
        sound = sound && p->state[texel] <= VSHI_TEXEL_INVALID &&
                (p->state[texel] != VSHI_TEXEL_EMPTY) == (p->mesh[texel] != 0) &&
                is_sound(page, &p->ao, texel) && is_sound(page, &p->sky, texel);
    }
    const vshi_shots *shots[2] = {&p->ao, &p->sky};
    for (size_t s = 0; s < 2; ++s) {
        for (size_t k = 0; shots[s]->held != NULL && k < shots[s]->held[tile].count; ++k) {
            sound = sound && is_held_sound(page, &shots[s]->held[tile].list[k], tile);
        }
    }
    return sound ? VSH_OK : vshi_part_damaged(path, "its tiles", error);
}
