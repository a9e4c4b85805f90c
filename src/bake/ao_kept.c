#include "bake/ao_kept.h"

#include "shade/ao.h"

#include <math.h>
#include <string.h>

enum { NORMAL = 3 * sizeof(float), OPEN = 3 * sizeof(float), TANGENT = 4 * sizeof(float) };

static bool has(uint32_t kinds, uint32_t kind) {
    return (kinds & kind) != 0;
}

size_t vshi_ao_kept_bytes(uint32_t kinds) {
    return VSHI_KEPT_POSITION + NORMAL + (has(kinds, VSHI_KEEPS_AO) ? sizeof(vshi_ao_shot) : 0) +
           (has(kinds, VSHI_KEEPS_SKY) ? sizeof(vshi_ao_shot) : 0) +
           (has(kinds, VSHI_KEEPS_OPEN) ? OPEN : 0) + (has(kinds, VSHI_KEEPS_TANGENT) ? TANGENT : 0);
}

/* The next array of so many bytes; NULL where there is none. */
static void *next_of(unsigned char **at, bool there, size_t bytes) {
    void *array = there ? *at : NULL;
    *at += there ? bytes : 0;
    return array;
}

vshi_ao_kept vshi_ao_kept_row(uint32_t kinds, size_t width, void *memory, size_t row) {
    unsigned char *at = (unsigned char *)memory + row * width * vshi_ao_kept_bytes(kinds);
    vshi_ao_kept kept;
    kept.position = next_of(&at, true, width * VSHI_KEPT_POSITION);
    kept.normal = next_of(&at, true, width * NORMAL);
    kept.ao = next_of(&at, has(kinds, VSHI_KEEPS_AO), width * sizeof *kept.ao);
    kept.sky = next_of(&at, has(kinds, VSHI_KEEPS_SKY), width * sizeof *kept.sky);
    kept.open = next_of(&at, has(kinds, VSHI_KEEPS_OPEN), width * OPEN);
    kept.tangent = next_of(&at, has(kinds, VSHI_KEEPS_TANGENT), width * TANGENT);
    return kept;
}

/* --- whether a bake can have kept it */

static bool is_lattice(uint32_t level, int32_t spacing) {
    return level > 0 && level <= (uint32_t)spacing && (level & (level - 1)) == 0;
}

static bool is_sound(const vshi_ao_shot *shot, int32_t spacing, int32_t held_rays) {
    enum { MOST_RAYS = 1 << 24 };
    if (shot->level == 0 || shot->level == VSHI_AO_KNOWN_LEVEL) {
        return shot->rays == 0;
    }
    return is_lattice(shot->level, spacing) && shot->rays >= 0 && shot->rays <= MOST_RAYS &&
           (shot->rays == 0 || (shot->shot >= 0.0f && shot->shot <= 1.0f)) &&
           (shot->held[1] & 0xffff) <= (uint32_t)held_rays && shot->held[1] >> 16 <= (uint32_t)held_rays;
}

/* Whether it is a mean of directions as of vshi_ao_mean(): what they lean by is taken out. */
static bool is_mean(const float *open) {
    static const float LONGEST = 3.0f;
    return fabsf(open[0]) <= LONGEST && fabsf(open[1]) <= LONGEST && fabsf(open[2]) <= LONGEST;
}

bool vshi_ao_kept_is_sound(const vshi_ao_kept *kept, size_t width, int32_t spacing, int32_t held_rays) {
    bool sound = true;
    for (size_t i = 0; i < width; ++i) {
        sound = sound && (kept->ao == NULL || is_sound(&kept->ao[i], spacing, held_rays)) &&
                (kept->sky == NULL || is_sound(&kept->sky[i], spacing, held_rays)) &&
                (kept->open == NULL || is_mean(kept->open + 3 * i));
    }
    return sound;
}

bool vshi_ao_is_left(const vshi_ao_shot *shot) {
    return shot->level != 0 && shot->level != VSHI_AO_KNOWN_LEVEL;
}

/* --- of a band */

void vshi_ao_keep_clear(const vshi_ao_keep *keep) {
    if (keep->memory != NULL) {
        const int32_t rows =
            vshi_ao_cut_kept(keep->cut, keep->end) - vshi_ao_cut_kept(keep->cut, keep->first);
        memset(keep->memory, 0, (size_t)rows * (size_t)keep->width * vshi_ao_kept_bytes(keep->cut->kinds));
    }
}

bool vshi_ao_keep_row(const vshi_ao_keep *keep, int32_t row, vshi_ao_kept *kept) {
    if (keep->memory == NULL || row < keep->first || row >= keep->end) {
        return false;
    }
    const int32_t at = vshi_ao_cut_kept(keep->cut, row);
    *kept = vshi_ao_kept_row(keep->cut->kinds, (size_t)keep->width, keep->memory,
                             (size_t)(at - vshi_ao_cut_kept(keep->cut, keep->first)));
    return vshi_ao_cut_kept(keep->cut, row + 1) > at;
}

vshi_ao_shot *vshi_ao_keep_left(const vshi_ao_keep *keep, int32_t column, int32_t row) {
    vshi_ao_kept kept;
    if (!vshi_ao_cut_leaves(keep->cut, row / VSHI_AO_CUT_TILE) || !vshi_ao_keep_row(keep, row, &kept)) {
        return NULL;
    }
    vshi_ao_shot *shot = &(keep->sky ? kept.sky : kept.ao)[column];
    return vshi_ao_is_left(shot) ? shot : NULL;
}
